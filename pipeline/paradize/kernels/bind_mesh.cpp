#include <nanobind/nanobind.h>
NB_MODULE(_mesh, m) { m.doc() = "mesh kernels"; }
