// Functions for rows of normals, not compiled for any wider instruction set.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <utility>

#include "normals/types.hpp"
#include "simd/cpu.hpp"

#ifdef PARADIZE_WIDE
#include <immintrin.h>
#endif
