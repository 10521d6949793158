/* What compiled formulas need of Python: the numbers of arrays, and to be called.
 *
 * The prototypes are those of CPython's stable ABI (3.11), so that no header of a Python is needed to build. */
#include <stdint.h>
#include <string.h>

typedef intptr_t ssize;
typedef struct Object { ssize references; struct Object *type; } Object;
typedef struct {
    char *buf; Object *obj; ssize len, itemsize; int readonly, ndim; char *format;
    ssize *shape, *strides, *suboffsets; void *internal;
} Buffer;
/* The public fields of numpy's arrays. */
typedef struct { Object head; char *data; int nd; ssize *shape, *strides; Object *base, *dtype; int flags; } Array;

extern Object *PyExc_TypeError, *PyExc_RuntimeError;
int PyObject_GetBuffer(Object *, Buffer *, int);
void PyBuffer_Release(Buffer *);
void PyErr_Clear(void), PyEval_RestoreThread(void *);
Object *PyErr_Occurred(void), *PyErr_Format(Object *, const char *, ...), *PyLong_FromLongLong(long long);
long long PyLong_AsLongLong(Object *);
char *PyBytes_AsString(Object *);
void *PyEval_SaveThread(void);

enum { BAD_BUFFER = -1, CONTIGUOUS = 1, C_CONTIGUOUS_WITH_FORMAT = 0x38 | 0x04, MOST = 64 };

static Object *ndarray, *float64;

/* Take the types of exact arrays; those of another numpy, whose fields lie elsewhere, go through the buffer protocol. */
void ftqp_begin(Object *array_type, Object *dtype, Array *probe, int64_t data) {
    int as_expected = probe->head.type == array_type && (int64_t)probe->data == data && probe->nd == 2
        && probe->shape[0] == 2 && probe->shape[1] == 3 && probe->dtype == dtype && (probe->flags & CONTIGUOUS);
    ndarray = as_expected ? array_type : 0, float64 = dtype;
}

static int64_t copied(const char *data, const ssize *shape, int nd, int64_t first, int64_t into, int64_t count, int64_t nd_wanted) {
    int64_t found = 1;
    if (nd < 1 || (nd_wanted && nd_wanted != nd) || (nd_wanted == 2 && shape[0] != shape[1])) return BAD_BUFFER;
    for (int k = 0; k < nd; k++) found *= shape[k];
    found = found > first ? found - first : 0;
    memmove((char *)into, data + 8 * first, 8 * (size_t)(found < count ? found : count));
    return found;
}

static int is_float64(const Buffer *view) {
    const char *name = view->format;
    if (view->itemsize != 8 || !name) return 0;
    if (*name == '@' || *name == '=' || *name == '<') name++;
    return name[0] == 'd' && name[1] == 0;
}

/* Copy numbers out of an object: how many it has from the first on, or BAD_BUFFER; no Python error is left. */
int64_t ftqp_take(int64_t source, int64_t first, int64_t into, int64_t count, int64_t dimensions) {
    const Array *a = (const Array *)source;
    if (a->head.type == ndarray && a->dtype == float64 && (a->flags & CONTIGUOUS))
        return copied(a->data, a->shape, a->nd, first, into, count, dimensions);
    Buffer view;
    if (PyObject_GetBuffer((Object *)source, &view, C_CONTIGUOUS_WITH_FORMAT)) return PyErr_Clear(), BAD_BUFFER;
    int64_t found = BAD_BUFFER;
    if (is_float64(&view)) found = copied(view.buf, view.shape, view.ndim, first, into, count, dimensions);
    PyBuffer_Release(&view);
    return found;
}

/* An entry point, as the bytes that stand for ``self`` hold it. */
typedef struct { int64_t (*function)(const int64_t *); int64_t nogil, count; char letters[MOST]; char name[]; } Entry;

Object *ftqp_call(Object *self, Object *const *given, ssize count) {
    const Entry *entry = (const Entry *)PyBytes_AsString(self);
    int64_t values[MOST];
    if (count != entry->count) return PyErr_Format(PyExc_TypeError, "%s takes %d arguments", entry->name, (int)entry->count);
    for (ssize k = 0; k < count; k++) {
        values[k] = entry->letters[k] == 'o' ? (int64_t)given[k] : PyLong_AsLongLong(given[k]);
        if (values[k] == -1 && PyErr_Occurred()) return 0;
    }
    void *state = entry->nogil ? PyEval_SaveThread() : 0;
    int64_t answer = entry->function(values);
    if (state) PyEval_RestoreThread(state);
    return answer == INT64_MIN ? PyErr_Format(PyExc_RuntimeError, "%s failed in compiled code", entry->name) : PyLong_FromLongLong(answer);
}
