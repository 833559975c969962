#include "openmesh/surface.hpp"

#include <algorithm>
#include <stdexcept>
#include <string>

#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#include <OpenMesh/Core/System/omstream.hh>
#include <OpenMesh/Tools/Decimater/DecimaterT.hh>
#include <OpenMesh/Tools/Decimater/ModNormalFlippingT.hh>
#include <OpenMesh/Tools/Decimater/ModQuadricT.hh>

namespace paradize::openmesh {

namespace {

struct Double : OpenMesh::DefaultTraits {
    using Point = OpenMesh::Vec3d;
    using Normal = OpenMesh::Vec3d;
    VertexAttributes(OpenMesh::Attributes::Status);
    EdgeAttributes(OpenMesh::Attributes::Status);
    HalfedgeAttributes(OpenMesh::Attributes::PrevHalfedge | OpenMesh::Attributes::Status);
    FaceAttributes(OpenMesh::Attributes::Status | OpenMesh::Attributes::Normal);
};
using Surface = OpenMesh::TriMesh_ArrayKernelT<Double>;

Surface surface_of(std::span<const double> positions, std::span<const std::uint32_t> triangles) {
    omerr().disable(); // a face that it does not take is seen by its handle
    Surface surface;
    const std::size_t vertices = positions.size() / 3;
    const std::size_t faces = triangles.size() / 3;
    surface.reserve(vertices, vertices + faces, faces);
    for (std::size_t i = 0; i < positions.size(); i += 3) {
        surface.add_vertex({positions[i], positions[i + 1], positions[i + 2]});
    }
    const auto corner = [&](std::size_t at) {
        return surface.vertex_handle(static_cast<unsigned>(triangles[at]));
    };
    for (std::size_t i = 0; i < triangles.size(); i += 3) {
        surface.add_face(corner(i), corner(i + 1), corner(i + 2));
    }
    return surface;
}

} // namespace

Counts count(std::span<const double> positions, std::span<const std::uint32_t> triangles) {
    const Surface surface = surface_of(positions, triangles);
    Counts result{surface.n_faces(), surface.n_edges(), 0};
    for (const auto halfedge : surface.halfedges()) {
        result.border += surface.is_boundary(halfedge) ? 1 : 0;
    }
    return result;
}

Simplified simplify(std::span<const double> positions, std::span<const std::uint32_t> triangles,
                    std::size_t target) {
    Surface surface = surface_of(positions, triangles);
    if (surface.n_faces() != triangles.size() / 3) {
        throw std::invalid_argument("the surface is no manifold: OpenMesh holds " +
                                    std::to_string(surface.n_faces()) + " of its " +
                                    std::to_string(triangles.size() / 3) + " triangles");
    }
    surface.update_face_normals();
    OpenMesh::Decimater::DecimaterT<Surface> decimater(surface);
    OpenMesh::Decimater::ModQuadricT<Surface>::Handle quadric;
    OpenMesh::Decimater::ModNormalFlippingT<Surface>::Handle flipping;
    decimater.add(quadric);
    decimater.add(flipping);
    decimater.module(quadric).unset_max_err();
    if (!decimater.initialize()) {
        throw std::logic_error("OpenMesh does not begin to simplify");
    }
    decimater.decimate_to_faces(0, target);

    Simplified result;
    std::vector<std::uint32_t> number(surface.n_vertices());
    for (const auto face : surface.faces()) { // those that are left
        for (const auto vertex : surface.fv_range(face)) {
            number[static_cast<std::size_t>(vertex.idx())] = 1;
        }
    }
    for (std::size_t i = 0; i < number.size(); ++i) {
        if (number[i] != 0) {
            number[i] = static_cast<std::uint32_t>(result.vertex.size());
            result.vertex.push_back(static_cast<std::uint32_t>(i));
        }
    }
    for (const auto face : surface.faces()) {
        for (const auto vertex : surface.fv_range(face)) {
            result.triangles.push_back(number[static_cast<std::size_t>(vertex.idx())]);
        }
    }
    return result;
}

} // namespace paradize::openmesh
