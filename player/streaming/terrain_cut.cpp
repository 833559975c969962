#include "streaming/terrain_cut.hpp"

#include <glm/geometric.hpp>

#include <algorithm>

namespace paradize {

TerrainCut::TerrainCut(const assets::TerrainPatches &patches, const assets::TerrainDiamonds &diamonds)
    : patches_(patches), diamonds_(diamonds), first_made_(diamonds.size() + 1), width_(diamonds.size()),
      missing_(diamonds.size()), here_(patches.size()), split_(diamonds.size()), shown_(diamonds.size()) {
    for (std::uint32_t patch = 0; patch < patches.size(); ++patch) {
        if (patches.diamond[patch] >= 0) {
            ++width_[static_cast<std::size_t>(patches.diamond[patch])];
        }
        if (patches.made_by[patch] < 0) {
            roots_.push_back(patch);
        } else {
            ++missing_[static_cast<std::size_t>(patches.made_by[patch])];
        }
    }
    for (std::size_t diamond = 0; diamond < diamonds.size(); ++diamond) {
        first_made_[diamond + 1] = first_made_[diamond] + missing_[diamond];
    }
    made_.resize(first_made_.back());
    std::vector<std::uint32_t> next(first_made_.begin(), first_made_.end() - 1);
    for (std::uint32_t patch = 0; patch < patches.size(); ++patch) {
        if (patches.made_by[patch] >= 0) {
            made_[next[static_cast<std::size_t>(patches.made_by[patch])]++] = patch;
        }
    }
    reached_.reserve(patches.size());
    cut_.reserve(patches.size());
}

void TerrainCut::arrived(std::uint32_t patch) {
    here_[patch] = 1;
    ++arrived_count_;
    if (patches_.made_by[patch] >= 0) {
        --missing_[static_cast<std::size_t>(patches_.made_by[patch])];
    }
}

bool TerrainCut::wants_split(std::uint32_t diamond, const CutEye &eye) const {
    const float distance_m = glm::distance(eye.position, diamonds_.center[diamond]);
    return diamonds_.error_m[diamond] * eye.pixels_at_1m >
           eye.error_px * std::max(eye.near_m, distance_m - diamonds_.radius_m[diamond]);
}

void TerrainCut::update(const CutEye &eye) {
    for (const std::uint32_t patch : reached_) {
        if (patches_.diamond[patch] >= 0) {
            split_[static_cast<std::size_t>(patches_.diamond[patch])] = 0;
            shown_[static_cast<std::size_t>(patches_.diamond[patch])] = 0;
        }
    }
    reached_.assign(roots_.begin(), roots_.end());
    for (std::size_t i = 0; i < reached_.size(); ++i) { // grows: each split appends what it makes
        const std::int32_t diamond = patches_.diamond[reached_[i]];
        if (diamond < 0) {
            continue;
        }
        const auto d = static_cast<std::uint32_t>(diamond);
        // The last of its patches to be shown decides: by then all that made them are split.
        if (++shown_[d] == width_[d] && missing_[d] == 0 && wants_split(d, eye)) {
            split_[d] = 1;
            reached_.insert(reached_.end(), made_.begin() + first_made_[d],
                            made_.begin() + first_made_[d + 1]);
        }
    }
    cut_.clear();
    for (const std::uint32_t patch : reached_) {
        const std::int32_t diamond = patches_.diamond[patch];
        if (here_[patch] != 0 && (diamond < 0 || split_[static_cast<std::size_t>(diamond)] == 0)) {
            cut_.push_back(patch);
        }
    }
    std::sort(cut_.begin(), cut_.end());
}

} // namespace paradize
