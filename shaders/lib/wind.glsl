// Moves a vertex with the wind. Gusts are two waves that travel with the wind; a plant leans with the gust
// that passes it and sways about that; leaves that hang on it flutter. All of it is continuous over space, so that no
// two vertices at one place part. After T. Sousa, "Vegetation Procedural Animation and Shading in Crysis",
// GPU Gems 3, 2007, chapter 16. player/scene/wind.cpp has the same waves.

// p: the vertex in the view's coordinates. sway: its shares of lean and flutter (_SWAY). reach: metres of
// both in a full gust.
vec3 in_wind(vec3 p, vec2 sway, vec2 reach) {
    float along = wind.z * dot(wind.xy, p.xz);
    float across = wind.z * dot(wind.xy, vec2(p.z, -p.x));
    float gust =
        0.6 + 0.25 * sin(along + wind_phases.x) + 0.15 * sin(1.7 * along + 0.9 * across + wind_phases.y);
    float lean = reach.x * sway.x * gust * (0.8 + 0.2 * sin(3.0 * along + wind_phases.z));
    float beat = dot(vec3(2.1, 1.3, 2.9), p) + wind_phases.w;
    vec2 flutter = reach.y * sway.y * gust * vec2(sin(beat), 0.4 * sin(2.0 * beat + 1.0));
    return p + vec3(wind.x * (lean + flutter.y), flutter.x, wind.y * (lean + flutter.y));
}
