// Functions for rows of BC7 blocks, not compiled for any wider instruction set.
#pragma once

#include <cstddef>
#include <cstdint>
#include <initializer_list>

#include "bc7/encode.hpp"
#include "bc7/pack.hpp"
#include "bc7/picture.hpp"
#include "simd/cpu.hpp"
