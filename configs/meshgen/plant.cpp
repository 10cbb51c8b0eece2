#include "plant.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <stdexcept>

namespace crt::meshgen {

double Random::number() {
    std::uint64_t z = state_ += 0x9e3779b97f4a7c15u;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return static_cast<double>((z ^ (z >> 31)) >> 11) * 0x1p-53;
}

Vec Random::direction() {
    for (;;) {
        Vec v;
        v.x = between(-1, 1);
        v.y = between(-1, 1);
        v.z = between(-1, 1);
        const double square = dot(v, v);
        if (square <= 1 && square > 1e-4) return unit(v);
    }
}

Vec Random::heading() {
    for (;;) {
        Vec v;
        v.x = between(-1, 1);
        v.z = between(-1, 1);
        const double square = dot(v, v);
        if (square <= 1 && square > 1e-4) return unit(v);
    }
}

Vec onCircle(double degrees) {
    // Of a 64th of the angle, doubled six times.
    const double angle = degrees * (kPi / 180 / 64), square = angle * angle;
    double c = 1 - square / 2 * (1 - square / 12 * (1 - square / 30 * (1 - square / 56)));
    double s = angle * (1 - square / 6 * (1 - square / 20 * (1 - square / 42 * (1 - square / 72))));
    for (int i = 0; i < 6; ++i) {
        const double twice = c * c - s * s;
        s = 2 * s * c;
        c = twice;
    }
    return {c, 0, s};
}

Vec turned(Vec heading, double degrees) {
    const Vec turn = onCircle(degrees);
    return {heading.x * turn.x - heading.z * turn.z, 0, heading.x * turn.z + heading.z * turn.x};
}

Vec anyNormal(Vec axis) {
    const bool level = std::abs(axis.y) < 0.7;
    return unit(cross(axis, level ? Vec{0, 1, 0} : Vec{1, 0, 0}));
}

Plant::Corner Plant::corner(std::size_t position, double u, double v) {
    const std::pair<int, int> uv{static_cast<int>(1000 * u + .5), static_cast<int>(1000 * v + .5)};
    const auto [found, is_new] = uv_index_.try_emplace(uv, static_cast<std::uint32_t>(uvs_.size()));
    if (is_new) uvs_.push_back(uv);
    return {static_cast<std::uint32_t>(position), found->second};
}

void Plant::addLimb(std::span<const Vec> points, std::span<const double> radii, unsigned sides) {
    const std::size_t rings = points.size() - 1, first = positions_.size(), tip = first + rings * sides;
    Vec across = anyNormal(unit(points[1] - points[0]));
    for (std::size_t ring = 0; ring < rings; ++ring) {
        const Vec along = unit(points[ring + 1] - points[ring > 0 ? ring - 1 : 0]);
        // The frame is carried along, so that the tube is not twisted.
        across = unit(across - dot(across, along) * along);
        const Vec other = cross(along, across);
        for (unsigned k = 0; k < sides; ++k) {
            const Vec turn = onCircle(360.0 * k / sides);
            const Vec outward = turn.x * across + turn.z * other;
            positions_.push_back(points[ring] + radii[ring] * outward);
            normals_.push_back(outward);
        }
    }
    positions_.push_back(points.back());
    normals_.push_back(unit(points[rings] - points[rings - 1]));

    const auto at = [&](std::size_t ring, unsigned k) {
        return corner(first + ring * sides + k % sides, static_cast<double>(k) / sides,
                      static_cast<double>(ring) / static_cast<double>(rings));
    };
    for (unsigned k = 2; k < sides; ++k) bark_.push_back({at(0, 0), at(0, k), at(0, k - 1)});
    for (std::size_t ring = 0; ring + 1 < rings; ++ring)
        for (unsigned k = 0; k < sides; ++k) {
            bark_.push_back({at(ring, k), at(ring, k + 1), at(ring + 1, k + 1)});
            bark_.push_back({at(ring, k), at(ring + 1, k + 1), at(ring + 1, k)});
        }
    for (unsigned k = 0; k < sides; ++k)
        bark_.push_back({at(rings - 1, k), at(rings - 1, k + 1), corner(tip, (k + .5) / sides, 1)});
}

void Plant::addLeaf(Vec base, Vec axis, Vec upper, double length, double width, double fold) {
    Vec across = cross(axis, upper);
    across = dot(across, across) > 1e-6 ? unit(across) : anyNormal(axis);
    const Vec normal = cross(across, axis);
    const Vec middle = base + 0.42 * length * axis + fold * width * normal, half = 0.5 * width * across;
    const std::size_t first = positions_.size();
    for (const Vec p : {base, middle + half, base + length * axis, middle - half}) positions_.push_back(p);
    const Corner root = corner(first, .5, 0), right = corner(first + 1, 1, .42),
                 tip = corner(first + 2, .5, 1), left = corner(first + 3, 0, .42);
    leaves_.push_back({root, right, tip});
    leaves_.push_back({root, tip, left});
}

void Plant::normalise() {
    double height = 0;
    for (const Vec& p : positions_) height = std::max(height, p.y);
    for (Vec& p : positions_) p = (1 / height) * p;
}

void Plant::writeObj(const std::filesystem::path& path, const char* title) const {
    std::FILE* file = std::fopen(path.c_str(), "wb");
    if (file == nullptr) throw std::runtime_error("cannot write " + path.string());
    std::fprintf(file, "# %s, %zu triangles. Written by crt-meshgen.\n", title, triangles());
    // Whole numbers of hundred-thousandths have no −0.
    const auto rounded = [](double x) { return static_cast<double>(std::lround(1e5 * x)) / 1e5; };
    for (const Vec& p : positions_)
        std::fprintf(file, "v %.5f %.5f %.5f\n", rounded(p.x), rounded(p.y), rounded(p.z));
    for (const Vec& n : normals_)
        std::fprintf(file, "vn %.5f %.5f %.5f\n", rounded(n.x), rounded(n.y), rounded(n.z));
    for (const auto& [u, v] : uvs_) std::fprintf(file, "vt %.3f %.3f\n", u / 1000.0, v / 1000.0);
    std::fputs("g bark\n", file);
    for (const Triangle& t : bark_) {
        std::fputc('f', file);
        for (const Corner& c : t) std::fprintf(file, " %u/%u/%u", c.position + 1, c.uv + 1, c.position + 1);
        std::fputc('\n', file);
    }
    std::fputs("g leaves\n", file);
    for (const Triangle& t : leaves_)
        std::fprintf(file, "f %u/%u %u/%u %u/%u\n", t[0].position + 1, t[0].uv + 1, t[1].position + 1,
                     t[1].uv + 1, t[2].position + 1, t[2].uv + 1);
    const bool failed = std::ferror(file) != 0;
    if (std::fclose(file) != 0 || failed) throw std::runtime_error("cannot write " + path.string());
}

}  // namespace crt::meshgen
