/// Small scenes, and what crt::compileScene makes of them.
#pragma once

#include "kernel_test.h"

#include <cstdint>
#include <cstring>
#include <functional>
#include <vector>

namespace compile_test {

using crt::CompiledScene;
using crt::Scene;
using crt::Vec3d;
using namespace kernel_test;

/// A floor of one quad, 10 wide, and above it a lamp of one quad.
inline Scene litFloor() {
    Scene scene;
    scene.camera.position = {0, 1, -5};
    scene.camera.target = {0, 0, 0};
    scene.film.width = 32;
    scene.film.height = 24;
    scene.materials.resize(1);
    scene.materials[0].reflectance = crt::constantSpectrum(0.5);
    scene.emissions.push_back({crt::constantSpectrum(2), false});
    crt::Mesh floor, lamp;
    floor.positions = {{-5, 0, -5}, {-5, 0, 5}, {5, 0, 5}, {5, 0, -5}};
    lamp.positions = {{-1, 2, -1}, {1, 2, -1}, {1, 2, 1}, {-1, 2, 1}};
    floor.triangles = lamp.triangles = {{0, 1, 2}, {0, 2, 3}};
    scene.meshes = {floor, lamp};
    scene.objects.resize(2);
    scene.objects[0].material = scene.objects[1].material = 0;
    scene.objects[1].mesh = 1;
    scene.objects[1].emission = 0;
    return scene;
}

inline CompiledScene compiled(const Scene& scene, std::uint32_t aovs = 0) {
    return crt::compileScene(scene, aovs);
}
inline CompiledScene changed(const std::function<void(Scene&)>& change) {
    Scene scene = litFloor();
    change(scene);
    return compiled(scene);
}
inline std::uint64_t featuresOf(const std::function<void(Scene&)>& change) {
    return changed(change).header().features;
}
inline const CrtScene& headerOf(const CompiledScene& c) {
    return c.header();
}

inline bool sameBytes(const CompiledScene& a, const CompiledScene& b) {
    return a.size_bytes == b.size_bytes && std::memcmp(a.data(), b.data(), a.size_bytes) == 0;
}

template <class T>
std::vector<T> listOf(const CompiledScene& c, CrtSpan span) {
    const T* first = arrayOf<T>(c, span);
    return std::vector<T>(first, first + span.count);
}

inline crt::Mesh smoothTetrahedron() {
    crt::Mesh mesh;
    mesh.positions = {{1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}};
    mesh.triangles = {{0, 1, 2}, {0, 3, 1}, {0, 2, 3}, {1, 3, 2}};
    mesh.normals = mesh.positions;
    mesh.normal_index = mesh.triangles;
    return mesh;
}

inline crt::Spectrum dispersiveIndex() {
    crt::Spectrum s = crt::constantSpectrum(1.5);
    s[0] = 1.6;
    return s;
}

inline crt::Environment clearSky(bool sampled) {
    crt::Environment sky{crt::illuminantSpectrum("D65").value(), sampled};
    sky.sky = crt::CieSky{.towards_sun = {0.6, 0.8, 0}, .rows = 16};
    return sky;
}

inline void makeGlass(Scene& s) {
    s.materials[0].type = crt::MaterialType::Dielectric;
    s.materials[0].eta = crt::constantSpectrum(1.5);
}

}  // namespace compile_test
