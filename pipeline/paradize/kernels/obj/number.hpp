// Decimal text -> float32 or float64, without locale.
#pragma once

namespace paradize::obj {

enum class NumberFault { none, garbage, too_large, not_finite };

// Reads one decimal number at `p` (optional sign, digits, point, exponent) and moves `p` past it.
// `out` is the number nearest to the decimal value; a magnitude below the smallest denormal gives zero. A
// float64 that lies halfway between two float32 numbers is the next one where else the float32 nearest to it
// would not be the one nearest to the decimal.
// A magnitude above the largest float32 is `too_large`; the words nan and inf are `not_finite`.
// On `garbage` nothing is moved. The caller checks what follows the number.
// Method: exact double product of a 53-bit integer and a power of ten up to 1e22 (Clinger, "How to read
// floating point numbers accurately", 1990), rounded to float unless that double is a halfway case; the rest
// by std::from_chars.
NumberFault read_number(const char *&p, const char *end, float &out);
NumberFault read_number(const char *&p, const char *end, double &out);

} // namespace paradize::obj
