#include "assets/scene/fields.hpp"

namespace paradize::assets {

namespace {
constexpr std::size_t most_ripples = 512;
constexpr double largest_radius_m = 1e3;
} // namespace

void read_ripples(const JsonObject &root, Water &out) {
    const auto from = root.object_or_none("ripples");
    if (!from) {
        return;
    }
    out.ripple_height_m = real(*from, "height_m", 0.0, 1.0);
    const std::vector<double> x = from->column("x_m", most_ripples, -max_position_m, max_position_m);
    const std::vector<double> z = from->column("z_m", most_ripples, -max_position_m, max_position_m);
    const std::vector<double> radius = from->column("radius_m", most_ripples, 0.0, largest_radius_m);
    for (const char *key : {"z_m", "radius_m"}) {
        const std::size_t size = std::string_view(key) == "z_m" ? z.size() : radius.size();
        if (size != x.size()) {
            from->fail(key, "has " + std::to_string(size) + " entries, must have as many as `x_m`, " +
                                std::to_string(x.size()));
        }
    }
    for (std::size_t i = 0; i < x.size(); ++i) {
        out.ripples.push_back({x[i], z[i], static_cast<float>(radius[i])});
    }
    from->reject_unknown_keys();
}

} // namespace paradize::assets
