// Rows of blocks for the instruction set that every x86-64 (or other) CPU has.
#define PARADIZE_WIDTH baseline
#include "bcn_rows.hpp"
