#include "streaming/terrain_cut.hpp"

#include <glm/geometric.hpp>

#include <algorithm>

namespace paradize {

TerrainCut::TerrainCut(const assets::TerrainPatches &patches, const assets::TerrainDiamonds &diamonds)
    : patches_(patches), diamonds_(diamonds), first_child_(diamonds.size() + 1),
      patch_count_(diamonds.size()), missing_children_(diamonds.size()), is_resident_(patches.size()),
      split_(diamonds.size()), reached_count_(diamonds.size()) {
    for (std::uint32_t patch = 0; patch < patches.size(); ++patch) {
        if (patches.diamond[patch] >= 0) {
            ++patch_count_[static_cast<std::size_t>(patches.diamond[patch])];
        }
        if (patches.parent_diamond[patch] < 0) {
            roots_.push_back(patch);
        } else {
            ++missing_children_[static_cast<std::size_t>(patches.parent_diamond[patch])];
        }
    }
    for (std::size_t diamond = 0; diamond < diamonds.size(); ++diamond) {
        first_child_[diamond + 1] = first_child_[diamond] + missing_children_[diamond];
    }
    children_.resize(first_child_.back());
    std::vector<std::uint32_t> next(first_child_.begin(), first_child_.end() - 1);
    for (std::uint32_t patch = 0; patch < patches.size(); ++patch) {
        if (patches.parent_diamond[patch] >= 0) {
            children_[next[static_cast<std::size_t>(patches.parent_diamond[patch])]++] = patch;
        }
    }
    reached_.reserve(patches.size());
    cut_.reserve(patches.size());
}

void TerrainCut::mark_resident(std::uint32_t patch) {
    is_resident_[patch] = 1;
    ++resident_count_;
    if (patches_.parent_diamond[patch] >= 0) {
        --missing_children_[static_cast<std::size_t>(patches_.parent_diamond[patch])];
    }
}

void TerrainCut::mark_absent(std::uint32_t patch) {
    is_resident_[patch] = 0;
    --resident_count_;
    if (patches_.parent_diamond[patch] >= 0) {
        ++missing_children_[static_cast<std::size_t>(patches_.parent_diamond[patch])];
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
            reached_count_[static_cast<std::size_t>(patches_.diamond[patch])] = 0;
        }
    }
    reached_.assign(roots_.begin(), roots_.end());
    for (std::size_t i = 0; i < reached_.size(); ++i) { // the vector grows: each split appends its children
        const std::int32_t diamond = patches_.diamond[reached_[i]];
        if (diamond < 0) {
            continue;
        }
        const auto d = static_cast<std::uint32_t>(diamond);
        // The last patch of a diamond to be reached decides. By then all diamonds above it are split.
        if (++reached_count_[d] == patch_count_[d] && missing_children_[d] == 0 && wants_split(d, eye)) {
            split_[d] = 1;
            reached_.insert(reached_.end(), children_.begin() + first_child_[d],
                            children_.begin() + first_child_[d + 1]);
        }
    }
    cut_.clear();
    for (const std::uint32_t patch : reached_) {
        const std::int32_t diamond = patches_.diamond[patch];
        if (is_resident_[patch] != 0 && (diamond < 0 || split_[static_cast<std::size_t>(diamond)] == 0)) {
            cut_.push_back(patch);
        }
    }
    std::sort(cut_.begin(), cut_.end());
}

} // namespace paradize
