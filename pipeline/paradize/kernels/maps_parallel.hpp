// For the rows of maps: see cpu.hpp.
#pragma once

#include "cpu.hpp"
