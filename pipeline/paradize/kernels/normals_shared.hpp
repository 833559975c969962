// What rows of normals need, not compiled for any wider instruction set.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <utility>

#include "cpu.hpp"
#include "normals_types.hpp"

#ifdef PARADIZE_WIDE
#include <immintrin.h>
#endif
