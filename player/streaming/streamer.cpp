#include "streaming/streamer.hpp"

#include "assets/artifact_loader.hpp"
#include "gl/buffer.hpp"
#include "streaming/uploads.hpp"

#include <epoxy/gl.h>

#include <algorithm>
#include <chrono>
#include <limits>
#include <utility>

namespace paradize {

SceneLoad::SceneLoad(const assets::SceneFile &file, const std::filesystem::path &folder,
                     const Streamer *before, const MemoryLimits &limits)
    : reused_(file.artifacts.size()), limits_(limits) {
    std::vector<std::uint32_t> order = file.streaming; // then all artifacts that it does not name
    for (std::uint32_t i = 0; i < file.artifacts.size(); ++i) {
        order.push_back(i);
    }
    std::vector<bool> seen(file.artifacts.size());
    std::vector<std::uint32_t> wanted;
    for (const std::uint32_t index : order) {
        if (seen[index]) {
            continue;
        }
        seen[index] = true;
        if (before != nullptr && limits.vram_bytes == 0) { // else one scene would evict what both draw
            reused_[index] = before->uploads_->find_reusable(file, file.artifacts[index]);
        }
        if (!reused_[index]) {
            wanted.push_back(index);
        }
    }
    loader_ = std::make_unique<assets::ArtifactLoader>(file, folder, std::move(wanted));
    checked_files_ = std::make_unique<assets::CheckedFiles>(folder);
}

SceneLoad::SceneLoad(SceneLoad &&) noexcept = default;
SceneLoad::~SceneLoad() = default;

bool SceneLoad::ready() const {
    return loader_->ready();
}

Streamer::Streamer(const assets::SceneFile &file, const std::filesystem::path &folder, const Streamer *before)
    : Streamer(file, SceneLoad(file, folder, before)) {}

Streamer::Streamer(const assets::SceneFile &file, SceneLoad load)
    : uploads_(std::make_unique<Uploads>(file)) {
    std::vector<assets::LoadedArtifact> loaded = load.loader_->take();
    uploads_->counts.open_ms = load.loader_->open_ms();
    glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
    // Values for attributes that a mesh lacks: normal upwards, tangent along X, colour white.
    glVertexAttrib3f(gl::attribute_normal, 0.0F, 1.0F, 0.0F);
    glVertexAttrib4f(gl::attribute_tangent, 1.0F, 0.0F, 0.0F, 1.0F);
    glVertexAttrib4f(gl::attribute_color, 1.0F, 1.0F, 1.0F, 1.0F);
    const PatchPages pages = patch_pages(file, load.limits_.vram_bytes);
    uploads_->geometry.patches = std::make_shared<GeometryPool>(pages.page_bytes, pages.slack_bytes);
    // Levels share buffers where none is evicted. Under a limit each has its own.
    uploads_->geometry.meshes = std::make_shared<GeometryPool>(0, std::numeric_limits<std::uint64_t>::max());
    uploads_->items = std::move(load.reused_);
    uploads_->first_piece.resize(uploads_->items.size());
    std::vector<std::uint32_t> order = load.loader_->wanted();
    uploads_->checked_files = std::move(load.checked_files_);
    for (std::uint32_t i = 0; i < uploads_->items.size(); ++i) {
        if (uploads_->items[i]) {
            ++uploads_->reused;
            order.push_back(i);
            const assets::LoadedArtifact &reused = uploads_->items[i]->loaded;
            if (!uploads_->checked_files->holds(file.artifacts[i], reused.file.stamp())) {
                uploads_->checked_files->add(file.artifacts[i], reused.file.stamp(), reused.checked_ns);
            }
        }
    }
    for (std::size_t i = 0; i < loaded.size(); ++i) {
        const std::uint32_t index = load.loader_->wanted()[i];
        uploads_->items[index] =
            std::make_shared<StreamItem>(file.artifacts[index], std::move(loaded[i]), uploads_->geometry);
        if (load.limits_.vram_bytes == 0) {
            uploads_->items[index]->mesh.expect();
        }
    }
    for (const std::uint32_t index : order) {
        uploads_->add_pieces(index);
    }
    uploads_->make_schedule(load.limits_);
    uploads_->max_waiting_bytes =
        load.limits_.ram_bytes - std::min(load.limits_.ram_bytes, Uploads::staging_bytes);
    uploads_->known_checked.resize(uploads_->items.size());
    uploads_->begun_files.resize(uploads_->items.size());
    uploads_->lost.resize(uploads_->items.size());
    std::uint64_t file_bytes = 0;
    for (const std::uint32_t index : load.loader_->wanted()) {
        file_bytes += file.artifacts[index].bytes;
    }
    uploads_->all_files_wait = file_bytes <= uploads_->max_waiting_bytes;
    uploads_->most_kept_open = files_to_keep_open();
    uploads_->unchecked_files = load.loader_->wanted().size();
    uploads_->checker = std::make_unique<assets::FileChecker>(
        load.loader_->wanted(), uploads_->items.size(),
        [uploads = uploads_.get()](std::uint32_t artifact, const std::stop_token &stop) {
            uploads->check(artifact, stop);
        });
    uploads_->loader = std::make_unique<assets::PieceLoader>(
        uploads_->pieces.size(),
        [uploads = uploads_.get()](std::uint32_t piece, assets::StageMemory &memory) {
            const Uploads::Clock::time_point start = Uploads::Clock::now();
            const assets::LoadedArtifact &loaded = uploads->item_of(piece).loaded;
            const assets::Piece &plan = uploads->plan_of(piece);
            assets::StagedPiece staged = assets::stage(loaded, plan, memory, &uploads->staging.ring());
            if (assets::needs_staging(loaded, plan)) { // else it was copied
                uploads->count_read(plan.bytes, start);
            }
            return staged;
        });
}

Streamer::~Streamer() {
    if (uploads_->unchecked_files != 0) {
        uploads_->checked_files->save(false); // else the checker has
    }
}

const StreamedTexture *Streamer::texture(std::string_view artifact) const {
    const assets::Artifact *found = uploads_->scene.find_artifact(artifact);
    return found == nullptr
               ? nullptr
               : &uploads_->items[static_cast<std::size_t>(found - uploads_->scene.artifacts.data())]
                      ->texture;
}

const StreamedMesh *Streamer::mesh(std::string_view artifact) const {
    const assets::Artifact *found = uploads_->scene.find_artifact(artifact);
    return found == nullptr
               ? nullptr
               : &uploads_->items[static_cast<std::size_t>(found - uploads_->scene.artifacts.data())]->mesh;
}

const StreamedTile &Streamer::tile(std::size_t index) const {
    return uploads_->items[uploads_->tiles[index]]->tile;
}

std::size_t Streamer::piece_count() const {
    return uploads_->pieces.size();
}

const assets::Piece &Streamer::piece(std::uint32_t index) const {
    return uploads_->plan_of(index);
}

std::pair<std::uint32_t, std::uint32_t> Streamer::pieces_of(std::string_view artifact) const {
    const assets::Artifact *found = uploads_->scene.find_artifact(artifact);
    if (found == nullptr) {
        return {0, 0};
    }
    const auto index = static_cast<std::size_t>(found - uploads_->scene.artifacts.data());
    return {uploads_->first_piece[index],
            static_cast<std::uint32_t>(uploads_->items[index]->loaded.plan.pieces.size())};
}

void Streamer::set_needs(std::span<const Need> needs) {
    std::ranges::copy(needs, uploads_->needs.begin());
}

void Streamer::begin_reading() {
    uploads_->plan();
}

double steady_ms() {
    const auto now = std::chrono::steady_clock::now().time_since_epoch();
    return std::chrono::duration<double, std::milli>(now).count();
}

bool Streamer::upload(const UploadBudget &budget) {
    return uploads_->upload(budget);
}

void Streamer::finish_checks() {
    uploads_->checker->finish();
}

bool Streamer::checked() {
    return uploads_->checker->finished();
}

bool Streamer::complete() const {
    return uploads_->pieces_left == 0;
}

bool Streamer::settled() const {
    return uploads_->settled();
}

const StreamingCounts &Streamer::counts() const {
    return uploads_->counts;
}

std::span<const std::string> Streamer::failures() const {
    return uploads_->failures;
}

std::size_t Streamer::reused() const {
    return uploads_->reused;
}

} // namespace paradize
