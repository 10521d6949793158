/* What both programs need that time steps: the clock, an order of times, and the file of an arm. */
#ifndef TIMES_H
#define TIMES_H

#define _GNU_SOURCE
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "arm.h"
#include "ftqp.h"

static unsigned char file[1 << 24];

/* [us] */
static double now(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec * 1e6 + (double)t.tv_nsec * 1e-3;
}

static int compare(const void *a, const void *b) {
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static size_t read_file(const char *path, void *into, size_t most) {
    FILE *in = fopen(path, "rb");
    if (in == NULL) return 0;
    const size_t bytes = fread(into, 1, most, in);
    fclose(in);
    return bytes;
}

#endif
