// The part of module _reference that reference/bind_seen.cpp defines.
#pragma once

#include <nanobind/nanobind.h>

void bind_reference_seen(nanobind::module_ &m);
