// For tiles of terrain: see parallel.hpp.
#pragma once

#include "parallel.hpp"
