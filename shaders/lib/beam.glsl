// The shape of a beam of light into the sky.

// Its width at a height above its foot, metres: where its light has fallen to 1 / e of that on the axis.
float beam_width(float height_m) { return 0.09 + 0.035 * max(height_m, 0.0); }
