// The part of module _reference that reference/bind_layout.cpp defines.
#pragma once

#include <nanobind/nanobind.h>

void bind_reference_layout(nanobind::module_ &m);
