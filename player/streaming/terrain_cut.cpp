#include "streaming/terrain_cut.hpp"

#include <glm/geometric.hpp>

#include <algorithm>

namespace paradize {

TerrainCut::TerrainCut(const assets::TerrainPatches &patches, const assets::TerrainDiamonds &diamonds)
    : patches_(patches), diamonds_(diamonds), first_child_(diamonds.size() + 1),
      patch_count_(diamonds.size()), missing_children_(diamonds.size()), is_resident_(patches.size()),
      is_fading_(diamonds.size()), split_(diamonds.size()), limit_(diamonds.size(), 1.0F),
      reached_count_(diamonds.size()) {
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

/// The share of dither values at which the diamond's error is visible.
float TerrainCut::wanted_split(std::uint32_t diamond, const CutEye &eye) const {
    const float distance_m = glm::distance(eye.position, diamonds_.center[diamond]);
    const float error = diamonds_.error_m[diamond] * eye.pixels_at_1m;
    const float accepted = eye.error_px * std::max(eye.near_m, distance_m - diamonds_.radius_m[diamond]);
    if (error > accepted) {
        return 1.0F;
    }
    if (!is_fading_[diamond] || error <= fade_begin * accepted) {
        return 0.0F;
    }
    return (error / accepted - fade_begin) / (1.0F - fade_begin);
}

PatchFade TerrainCut::fade(std::uint32_t patch) const {
    const std::int32_t parent = patches_.parent_diamond[patch];
    const std::int32_t diamond = patches_.diamond[patch];
    return {diamond < 0 ? 0.0F : split_[static_cast<std::size_t>(diamond)],
            parent < 0 ? 1.0F : split_[static_cast<std::size_t>(parent)]};
}

void TerrainCut::update(const CutEye &eye) {
    for (const std::uint32_t patch : reached_) {
        if (patches_.diamond[patch] >= 0) {
            split_[static_cast<std::size_t>(patches_.diamond[patch])] = 0.0F;
            limit_[static_cast<std::size_t>(patches_.diamond[patch])] = 1.0F;
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
        limit_[d] = std::min(limit_[d], fade(reached_[i]).to);
        // The last patch of a diamond to be reached decides. By then all diamonds above it are split.
        if (++reached_count_[d] == patch_count_[d] && missing_children_[d] == 0) {
            split_[d] = std::min(limit_[d], wanted_split(d, eye));
        }
        if (split_[d] > 0.0F) {
            reached_.insert(reached_.end(), children_.begin() + first_child_[d],
                            children_.begin() + first_child_[d + 1]);
        }
    }
    cut_.clear();
    for (const std::uint32_t patch : reached_) {
        const PatchFade shown = fade(patch);
        if (is_resident_[patch] != 0 && shown.from < shown.to) {
            cut_.push_back(patch);
        }
    }
    std::sort(cut_.begin(), cut_.end());
}

} // namespace paradize
