#include "streamer.hpp"

#include "assets/glb.hpp"
#include "assets/ktx2.hpp"
#include "assets/loader.hpp"
#include "assets/mapped_file.hpp"
#include "assets/stream_plan.hpp"
#include "error.hpp"
#include "gl/buffer.hpp"
#include "gl/texture.hpp"
#include "texture_format.hpp"

#include <epoxy/gl.h>

#include <algorithm>
#include <array>

namespace paradize {

void StreamedTexture::bind(unsigned unit, unsigned sampler) const {
    gl::bind_texture(unit, target_, resident() ? texture_.name() : fallback_.name(), sampler);
}

int StreamedMesh::best_level(int wanted) const {
    const int count = static_cast<int>(levels_.size());
    for (int level = wanted; level < count; ++level) {
        if (levels_[static_cast<std::size_t>(level)].resident) {
            return level;
        }
    }
    for (int level = std::min(wanted, count) - 1; level >= 0; --level) {
        if (levels_[static_cast<std::size_t>(level)].resident) {
            return level;
        }
    }
    return -1;
}

void StreamedMesh::draw(int level, int material) const {
    const MeshLevel &mesh = levels_[static_cast<std::size_t>(level)];
    glBindVertexArray(mesh.vertex_array.name());
    for (const MeshPrimitive &primitive : mesh.primitives) {
        if (material < 0 || primitive.material == material) {
            glDrawElements(GL_TRIANGLES, primitive.index_count, mesh.index_type,
                           reinterpret_cast<const void *>(primitive.index_offset));
        }
    }
}

namespace {

constexpr std::array<int, assets::mesh_attributes> components{3, 3, 4, 2, 2, 4};

constexpr std::size_t aligned(std::size_t bytes) {
    return (bytes + 15) & ~std::size_t{15};
}

} // namespace

/// One artifact on its way.
struct StreamItem {
    assets::MappedFile file;
    assets::Ktx2 ktx;
    assets::Glb glb;
    std::string path; // empty: not opened yet, or a sound
    StreamedTexture texture;
    StreamedMesh mesh;
    assets::ArtifactKind kind = assets::ArtifactKind::sound;
    std::vector<std::vector<std::size_t>> offsets; // mesh: per level and part, byte in its buffer
    std::size_t pieces_left = 0;
};

struct Streamer::Impl {
    const assets::SceneFile &scene;
    std::vector<StreamItem> items; // one per artifact, same order
    std::vector<assets::StreamPiece> pieces;
    std::size_t next = 0;
    std::uint64_t resident = 0;
    std::uint64_t total = 0;
    std::unique_ptr<assets::Loader> loader;

    explicit Impl(const assets::SceneFile &file) : scene(file), items(file.artifacts.size()) {}

    void open(std::uint32_t index, const std::filesystem::path &folder) {
        const assets::Artifact &artifact = scene.artifacts[index];
        StreamItem &item = items[index];
        item.kind = artifact.kind;
        if (artifact.kind == assets::ArtifactKind::sound) {
            return;
        }
        item.path = (folder / artifact.file).string();
        item.file = assets::MappedFile(item.path);
        const std::span<const std::byte> bytes = item.file.bytes();
        if (artifact.bytes != 0 && artifact.bytes != bytes.size()) {
            throw Error(item.path + ": has " + std::to_string(bytes.size()) + " bytes, scene.json says " +
                        std::to_string(artifact.bytes) + "; bake the scene again");
        }
        const std::size_t before = pieces.size();
        if (artifact.kind == assets::ArtifactKind::mesh) {
            item.glb = assets::read_glb(bytes, item.path);
            plan_mesh(item.glb, index, pieces);
            make_mesh(item);
        } else {
            item.ktx = assets::read_ktx2(bytes, item.path);
            const bool cube = artifact.kind == assets::ArtifactKind::cubemap;
            if (cube != (item.ktx.faces == 6)) {
                throw Error(item.path + ": has " + std::to_string(item.ktx.faces) + " faces, which is no " +
                            (cube ? "cube map" : "flat texture"));
            }
            plan_texture(item.ktx, index, pieces);
            make_texture(item);
        }
        item.pieces_left = pieces.size() - before;
    }

    static void make_texture(StreamItem &item) {
        StreamedTexture &out = item.texture;
        out.target_ = item.ktx.faces == 6 ? GL_TEXTURE_CUBE_MAP : GL_TEXTURE_2D;
        out.width_px_ = static_cast<int>(item.ktx.levels[0].width_px);
        out.height_px_ = static_cast<int>(item.ktx.levels[0].height_px);
        out.levels_ = static_cast<int>(item.ktx.levels.size());
        out.finest_ = out.levels_;
        out.texture_ = allocate_texture(item.ktx, item.path, best_storage());
        out.fallback_ = neutral_texture(item.ktx);
    }

    static void make_mesh(StreamItem &item) {
        StreamedMesh &out = item.mesh;
        out.materials_ = item.glb.materials;
        for (const assets::GlbLevel &level : item.glb.levels) {
            MeshLevel &made = out.levels_.emplace_back();
            std::vector<std::size_t> &offsets = item.offsets.emplace_back();
            std::size_t bytes = 0;
            for (std::uint32_t part = 0; part < assets::mesh_attributes; ++part) {
                offsets.push_back(bytes);
                bytes += aligned(mesh_attribute(level, part).size());
            }
            made.vertex_array = gl::VertexArray::create();
            glBindVertexArray(made.vertex_array.name());
            made.vertices = gl::make_buffer(GL_ARRAY_BUFFER, bytes, gl::Usage::fixed);
            for (std::uint32_t part = 0; part < assets::mesh_attributes; ++part) {
                if (!mesh_attribute(level, part).empty()) {
                    gl::attribute_floats(part, components[part], made.vertices, 0, offsets[part]);
                }
            }
            made.has_uv1 = !level.uvs1.empty();
            std::size_t index_bytes = 0;
            for (const assets::GlbPrimitive &primitive : level.primitives) {
                offsets.push_back(index_bytes);
                made.primitives.push_back(
                    {static_cast<int>(primitive.material), static_cast<int>(primitive.count), index_bytes});
                index_bytes += aligned(primitive.indices.size());
            }
            made.index_type = level.index_bytes == 2 ? GL_UNSIGNED_SHORT : GL_UNSIGNED_INT;
            made.indices = gl::make_buffer(GL_ELEMENT_ARRAY_BUFFER, index_bytes, gl::Usage::fixed);
            glBindVertexArray(0);
        }
    }

    void upload_mesh(const assets::StreamPiece &piece) {
        StreamItem &item = items[piece.artifact];
        const assets::GlbLevel &level = item.glb.levels[piece.level];
        MeshLevel &made = item.mesh.levels_[piece.level];
        const bool indices = piece.part >= assets::mesh_attributes;
        if (indices) {
            if (const std::ptrdiff_t bad =
                    assets::first_bad_index(piece.bytes, level.index_bytes, level.vertices);
                bad >= 0) {
                throw Error(item.path + ": node " + level.name + ", primitive " +
                            std::to_string(piece.part - assets::mesh_attributes) + ", index " +
                            std::to_string(static_cast<std::size_t>(bad) + piece.offset / level.index_bytes) +
                            ": is not below the " + std::to_string(level.vertices) + " vertices");
            }
        }
        // A copy target, so that no vertex array's element buffer is disturbed.
        gl::write_buffer(GL_COPY_WRITE_BUFFER, indices ? made.indices : made.vertices,
                         item.offsets[piece.level][piece.part] + piece.offset, piece.bytes);
        made.resident = made.resident || piece.last;
    }

    void upload_texture(const assets::StreamPiece &piece) {
        StreamItem &item = items[piece.artifact];
        StreamedTexture &texture = item.texture;
        upload_rows(texture.texture_, item.ktx, piece);
        if (piece.last) {
            texture.finest_ = static_cast<int>(piece.level);
            glTexParameteri(texture.target_, GL_TEXTURE_BASE_LEVEL, texture.finest_);
            if (piece.inflated) {
                item.ktx.rooms[piece.level].release();
            }
        }
    }

    /// Is the next piece there? Throws Error when it never will be.
    bool next_ready(Unready unready) {
        if (!pieces[next].inflated) {
            return true; // mapped: at worst the disk is waited for
        }
        if (!loader->ready(next)) {
            if (unready == Unready::leave) {
                return false;
            }
            loader->advance(next);
            loader->wait(next);
        }
        if (const std::string &fault = loader->fault(next); !fault.empty()) {
            throw Error(items[pieces[next].artifact].path + ": level " + std::to_string(pieces[next].level) +
                        ": " + fault);
        }
        return true;
    }

    void upload_one() {
        const assets::StreamPiece &piece = pieces[next++];
        StreamItem &item = items[piece.artifact];
        if (item.kind == assets::ArtifactKind::mesh) {
            upload_mesh(piece);
        } else {
            upload_texture(piece);
        }
        resident += piece.bytes.size();
        if (--item.pieces_left == 0) {
            item.file.release_pages();
        }
    }
};

Streamer::Streamer(const assets::SceneFile &file, const std::filesystem::path &folder)
    : impl_(std::make_unique<Impl>(file)) {
    std::vector<std::uint32_t> order = file.streaming; // and after it what it does not name
    for (std::uint32_t i = 0; i < file.artifacts.size(); ++i) {
        order.push_back(i);
    }
    glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
    // What a mesh does not have: a normal upwards, a tangent along X, white.
    glVertexAttrib3f(gl::attribute_normal, 0.0F, 1.0F, 0.0F);
    glVertexAttrib4f(gl::attribute_tangent, 1.0F, 0.0F, 0.0F, 1.0F);
    glVertexAttrib4f(gl::attribute_color, 1.0F, 1.0F, 1.0F, 1.0F);
    for (const std::uint32_t index : order) {
        if (impl_->items[index].path.empty()) {
            impl_->open(index, folder);
        }
    }
    assets::order_pieces(impl_->pieces);
    for (const assets::StreamPiece &piece : impl_->pieces) {
        impl_->total += piece.bytes.size();
    }
    impl_->loader = std::make_unique<assets::Loader>(impl_->pieces);
}

Streamer::~Streamer() = default;

const StreamedTexture *Streamer::texture(std::string_view artifact) const {
    const assets::Artifact *found = impl_->scene.find_artifact(artifact);
    return found == nullptr
               ? nullptr
               : &impl_->items[static_cast<std::size_t>(found - impl_->scene.artifacts.data())].texture;
}

const StreamedMesh *Streamer::mesh(std::string_view artifact) const {
    const assets::Artifact *found = impl_->scene.find_artifact(artifact);
    return found == nullptr
               ? nullptr
               : &impl_->items[static_cast<std::size_t>(found - impl_->scene.artifacts.data())].mesh;
}

bool Streamer::upload(std::size_t budget_bytes, Unready unready) {
    std::size_t used = 0;
    while (!complete() && (used == 0 || used + impl_->pieces[impl_->next].bytes.size() <= budget_bytes) &&
           impl_->next_ready(unready)) {
        used += impl_->pieces[impl_->next].bytes.size();
        impl_->upload_one();
    }
    impl_->loader->advance(impl_->next);
    return complete();
}

bool Streamer::complete() const {
    return impl_->next == impl_->pieces.size();
}

std::uint64_t Streamer::resident_bytes() const {
    return impl_->resident;
}

std::uint64_t Streamer::total_bytes() const {
    return impl_->total;
}

} // namespace paradize
