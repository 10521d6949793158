"""The command line and the scenario file: composes the layers below, holds no algorithm."""
