// Functions for rows of blocks, not compiled for any wider instruction set.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <utility>

#include "simd/cpu.hpp"

#ifdef PARADIZE_WIDE
#include <immintrin.h>
#endif
