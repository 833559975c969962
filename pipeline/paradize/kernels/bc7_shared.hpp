// What rows of BC7 blocks need, not compiled for any wider instruction set.
#pragma once

#include <cstddef>
#include <cstdint>
#include <initializer_list>

#include "bc7_encode.hpp"
#include "bc7_pack.hpp"
#include "bc7_picture.hpp"
#include "cpu.hpp"
