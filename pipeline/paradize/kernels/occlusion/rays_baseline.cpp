// Rays for the instruction set that every x86-64 (or other) CPU has.
#define PARADIZE_WIDTH baseline
#define PARADIZE_LANES 4
#include "occlusion/rays.hpp"
