/// crt-meshgen OUTDIR: writes the meshes that the scenes in this folder use: sphere.obj, ball.obj,
/// figure.obj, dragon.obj, prism.obj.
///
/// They are made rather than shipped: the source says what they are, nothing is downloaded, and every run
/// writes the same bytes. Sphere and prism are written down directly. Figure and dragon are modelled as
/// signed distance fields (round bones, joined by a smooth minimum), polygonised by marching tetrahedra,
/// which always gives a closed surface, and simplified by quadric error to an exact number of triangles. So
/// triangles are small where the shape is fine and large where it is flat, as in a scan, which is what a BVH
/// has to be good at.
///
/// Every object stands on y = 0, is centred in x and z, has height 1, and faces −z.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <iterator>
#include <numeric>
#include <queue>
#include <stdexcept>
#include <string>
#include <unordered_map>
#include <vector>

namespace {

constexpr double kPi = 3.14159265358979323846;

// --- vectors ---------------------------------------------------------------------------------------------

struct Vec {
    double x = 0, y = 0, z = 0;
};
Vec operator+(Vec a, Vec b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
Vec operator-(Vec a, Vec b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
Vec operator*(double s, Vec a) { return {s * a.x, s * a.y, s * a.z}; }
double dot(Vec a, Vec b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
Vec cross(Vec a, Vec b) { return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x}; }
double length(Vec a) { return std::sqrt(dot(a, a)); }
Vec unit(Vec a) { return (1.0 / length(a)) * a; }
Vec mix(Vec a, Vec b, double t) { return (1.0 - t) * a + t * b; }
Vec mirrorX(Vec a) { return {-a.x, a.y, a.z}; }
Vec mirrorZ(Vec a) { return {a.x, a.y, -a.z}; }

// --- meshes ----------------------------------------------------------------------------------------------

struct Mesh {
    std::vector<Vec> positions;
    std::vector<Vec> normals;  ///< One per position, or empty for flat faces.
    std::vector<std::array<std::uint32_t, 3>> triangles;
};

/// Normal of a triangle, twice its area long.
Vec areaVector(const std::array<Vec, 3>& corner) {
    return cross(corner[1] - corner[0], corner[2] - corner[0]);
}
Vec areaVector(const Mesh& mesh, const std::array<std::uint32_t, 3>& t) {
    return areaVector({mesh.positions[t[0]], mesh.positions[t[1]], mesh.positions[t[2]]});
}

/// Stands the mesh on y = 0, centred in x and z, with height 1.
void normalise(Mesh& mesh) {
    Vec low = mesh.positions.front(), high = low;
    for (const Vec& p : mesh.positions) {
        low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
        high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
    }
    const double scale = 1.0 / (high.y - low.y);
    const Vec foot{0.5 * (low.x + high.x), low.y, 0.5 * (low.z + high.z)};
    for (Vec& p : mesh.positions) p = scale * (p - foot);
}

/// Vertex normals as the average of the faces around, weighted by area.
void addNormals(Mesh& mesh) {
    mesh.normals.assign(mesh.positions.size(), Vec{});
    for (const auto& t : mesh.triangles)
        for (const std::uint32_t v : t) mesh.normals[v] = mesh.normals[v] + areaVector(mesh, t);
    for (Vec& n : mesh.normals) n = unit(n);
}

/// Fixed text form: nine digits are enough to tell two floats apart, and the same everywhere.
void writeObj(const Mesh& mesh, const std::filesystem::path& path, const char* title) {
    std::FILE* file = std::fopen(path.c_str(), "wb");
    if (file == nullptr) throw std::runtime_error("cannot write " + path.string());
    std::fprintf(file, "# %s, %zu triangles. Written by crt-meshgen.\n", title, mesh.triangles.size());
    // Adding zero turns −0 into 0: which of the two a sum gives is unspecified.
    for (const Vec& p : mesh.positions)
        std::fprintf(file, "v %.9g %.9g %.9g\n", p.x + 0.0, p.y + 0.0, p.z + 0.0);
    for (const Vec& n : mesh.normals)
        std::fprintf(file, "vn %.9g %.9g %.9g\n", n.x + 0.0, n.y + 0.0, n.z + 0.0);
    for (const auto& t : mesh.triangles) {
        if (mesh.normals.empty())
            std::fprintf(file, "f %u %u %u\n", t[0] + 1, t[1] + 1, t[2] + 1);
        else
            std::fprintf(file, "f %u//%u %u//%u %u//%u\n", t[0] + 1, t[0] + 1, t[1] + 1, t[1] + 1, t[2] + 1,
                         t[2] + 1);
    }
    const bool failed = std::ferror(file) != 0;
    if (std::fclose(file) != 0 || failed) throw std::runtime_error("cannot write " + path.string());
}

// --- distance fields -------------------------------------------------------------------------------------

/// Minimum with a fillet of about width k where the two are equal.
double smoothMin(double a, double b, double k) {
    const double h = std::max(k - std::abs(a - b), 0.0) / k;
    return std::min(a, b) - 0.25 * h * h * k;
}

/// Distance to a cone from `a` to `b` with round ends of radius ra and rb: a bone.
double roundCone(Vec p, Vec a, Vec b, double ra, double rb) {
    const Vec ba = b - a, pa = p - a;
    const double l2 = dot(ba, ba), rr = ra - rb, a2 = l2 - rr * rr, il2 = 1.0 / l2;
    const double y = dot(pa, ba), z = y - l2;
    const Vec side = l2 * pa - y * ba;
    const double x2 = dot(side, side), y2 = y * y * l2, z2 = z * z * l2;
    const double k = (rr > 0 ? 1.0 : rr < 0 ? -1.0 : 0.0) * rr * rr * x2;
    if ((z > 0 ? 1.0 : -1.0) * a2 * z2 > k) return std::sqrt(x2 + z2) * il2 - rb;
    if ((y > 0 ? 1.0 : -1.0) * a2 * y2 < k) return std::sqrt(x2 + y2) * il2 - ra;
    return (std::sqrt(x2 * a2 * il2) + y * rr) * il2 - ra;
}

/// Close to the distance to an axis-aligned ellipsoid: exact on it, and with the right slope there.
double ellipsoid(Vec p, Vec centre, Vec radii) {
    const Vec q = p - centre;
    const Vec s{q.x / radii.x, q.y / radii.y, q.z / radii.z};
    const Vec g{s.x / radii.x, s.y / radii.y, s.z / radii.z};
    const double k0 = length(s), k1 = length(g);
    return k1 > 0.0 ? k0 * (k0 - 1.0) / k1 : -std::min({radii.x, radii.y, radii.z});
}

/// Distance to a box with edges rounded by r.
double roundBox(Vec p, Vec centre, Vec half, double r) {
    const Vec q{std::abs(p.x - centre.x) - half.x + r, std::abs(p.y - centre.y) - half.y + r,
                std::abs(p.z - centre.z) - half.z + r};
    const Vec outside{std::max(q.x, 0.0), std::max(q.y, 0.0), std::max(q.z, 0.0)};
    return length(outside) + std::min(std::max({q.x, q.y, q.z}), 0.0) - r;
}

/// Distance to a triangle thickened by r: a piece of skin.
double membrane(Vec p, Vec a, Vec b, Vec c, double r) {
    const Vec ba = b - a, cb = c - b, ac = a - c, pa = p - a, pb = p - b, pc = p - c;
    const Vec n = cross(ba, ac);
    const auto toEdge = [](Vec e, Vec q) {
        const Vec d = std::clamp(dot(e, q) / dot(e, e), 0.0, 1.0) * e - q;
        return dot(d, d);
    };
    const bool beside =
        dot(cross(ba, n), pa) < 0.0 || dot(cross(cb, n), pb) < 0.0 || dot(cross(ac, n), pc) < 0.0;
    const double d2 = beside ? std::min({toEdge(ba, pa), toEdge(cb, pb), toEdge(ac, pc)})
                             : dot(n, pa) * dot(n, pa) / dot(n, n);
    return std::sqrt(d2) - r;
}

/// Shapes put together one after the other, each blended into those before it.
class Field {
public:
    using Distance = std::function<double(Vec)>;

    void add(double blend, Distance distance) { parts_.push_back({blend, false, std::move(distance)}); }
    void carve(double blend, Distance distance) { parts_.push_back({blend, true, std::move(distance)}); }

    /// Which parts matter within `radius` of `centre`: most of a figure is far from any one place.
    std::vector<std::uint32_t> partsNear(Vec centre, double radius) const {
        std::vector<double> distance(parts_.size());
        double nearest = 1e30;
        for (std::size_t i = 0; i < parts_.size(); ++i) {
            distance[i] = parts_[i].distance(centre);
            if (!parts_[i].carved) nearest = std::min(nearest, distance[i]);
        }
        std::vector<std::uint32_t> near;
        for (std::size_t i = 0; i < parts_.size(); ++i) {
            const double reach = parts_[i].blend + 3.0 * radius;
            if (distance[i] < (parts_[i].carved ? reach : nearest + reach))
                near.push_back(static_cast<std::uint32_t>(i));
        }
        return near;
    }

    /// Negative inside. Everything below the ground is cut off.
    double operator()(Vec p, const std::vector<std::uint32_t>& near) const {
        double d = 1e30;
        for (const std::uint32_t i : near) {
            const Part& part = parts_[i];
            d = part.carved ? -smoothMin(-d, part.distance(p), part.blend)
                            : smoothMin(d, part.distance(p), part.blend);
        }
        return std::max(d, -p.y);
    }

private:
    struct Part {
        double blend;
        bool carved;
        Distance distance;
    };
    std::vector<Part> parts_;
};

// --- polygonisation --------------------------------------------------------------------------------------

/// The surface where `field` is zero inside the box, by marching tetrahedra on a grid of `step`. Each cube
/// is cut into six tetrahedra around one diagonal; neighbours agree on the cut of their common face, so the
/// surface is closed.
Mesh polygonise(const Field& field, Vec low, Vec high, double step) {
    constexpr int kBlock = 8;
    const auto blocks = [&](double extent) { return static_cast<int>(std::ceil(extent / (step * kBlock))); };
    const int bx = blocks(high.x - low.x), by = blocks(high.y - low.y), bz = blocks(high.z - low.z);
    const int nx = bx * kBlock, ny = by * kBlock, nz = bz * kBlock;  // Grid points.
    const auto pointAt = [&](int i, int j, int k) {
        return Vec{low.x + i * step, low.y + j * step, low.z + k * step};
    };
    const auto gridIndex = [&](int i, int j, int k) {
        return (static_cast<std::size_t>(k) * ny + j) * nx + i;
    };
    const auto blockIndex = [&](int i, int j, int k) {
        return (static_cast<std::size_t>(k / kBlock) * by + j / kBlock) * bx + i / kBlock;
    };

    // The field is a distance, near enough: a block whose centre is farther from the surface than its
    // corners holds none.
    std::vector<float> value(static_cast<std::size_t>(nx) * ny * nz);
    std::vector<std::vector<std::uint32_t>> near(static_cast<std::size_t>(bx) * by * bz);
    const double radius = 0.5 * std::sqrt(3.0) * kBlock * step;
    for (int k0 = 0; k0 < nz; k0 += kBlock)
        for (int j0 = 0; j0 < ny; j0 += kBlock)
            for (int i0 = 0; i0 < nx; i0 += kBlock) {
                const Vec centre = pointAt(i0, j0, k0) + 0.5 * kBlock * Vec{step, step, step};
                std::vector<std::uint32_t>& parts = near[blockIndex(i0, j0, k0)];
                parts = field.partsNear(centre, radius);
                const double at_centre = field(centre, parts);
                const bool empty = std::abs(at_centre) > 2.0 * radius;
                for (int k = k0; k < k0 + kBlock; ++k)
                    for (int j = j0; j < j0 + kBlock; ++j)
                        for (int i = i0; i < i0 + kBlock; ++i)
                            value[gridIndex(i, j, k)] =
                                static_cast<float>(empty ? at_centre : field(pointAt(i, j, k), parts));
            }

    Mesh mesh;
    std::unordered_map<std::uint64_t, std::uint32_t> vertex_on_edge;
    const auto vertexBetween = [&](std::array<int, 3> a, std::array<int, 3> b) {
        if (gridIndex(a[0], a[1], a[2]) > gridIndex(b[0], b[1], b[2])) std::swap(a, b);
        const int direction = (b[0] - a[0]) + 2 * (b[1] - a[1]) + 4 * (b[2] - a[2]);
        const std::uint64_t key = gridIndex(a[0], a[1], a[2]) * 8 + static_cast<unsigned>(direction);
        const auto [found, is_new] =
            vertex_on_edge.try_emplace(key, static_cast<std::uint32_t>(mesh.positions.size()));
        if (is_new) {
            const std::vector<std::uint32_t>& parts = near[blockIndex(a[0], a[1], a[2])];
            const Vec pa = pointAt(a[0], a[1], a[2]), pb = pointAt(b[0], b[1], b[2]);
            double ta = 0.0, tb = 1.0;
            double fa = value[gridIndex(a[0], a[1], a[2])], fb = value[gridIndex(b[0], b[1], b[2])];
            double t = fa / (fa - fb);
            for (int i = 0; i < 3;
                 ++i) {  // False position; three steps put the vertex on the surface to 1e-4 of the grid.
                const double f = field(mix(pa, pb, t), parts);
                if ((f < 0.0) == (fa < 0.0)) ta = t, fa = f;
                else tb = t, fb = f;
                if (fa == fb) break;
                t = ta + (tb - ta) * fa / (fa - fb);
            }
            // Not onto the grid point itself, where the vertices of many edges would meet in triangles of no
            // area.
            mesh.positions.push_back(mix(pa, pb, std::clamp(t, 0.02, 0.98)));
        }
        return found->second;
    };

    // Corners of the six tetrahedra, as bits x, y, z: the paths from corner 0 to corner 7 along three axes.
    constexpr int kTetrahedra[6][4] = {{0, 1, 3, 7}, {0, 3, 2, 7}, {0, 2, 6, 7},
                                       {0, 6, 4, 7}, {0, 4, 5, 7}, {0, 5, 1, 7}};
    for (int k = 0; k + 1 < nz; ++k)
        for (int j = 0; j + 1 < ny; ++j)
            for (int i = 0; i + 1 < nx; ++i) {
                const auto corner = [&](int c) {
                    return std::array<int, 3>{i + (c & 1), j + (c >> 1 & 1), k + (c >> 2)};
                };
                unsigned inside = 0;
                for (int c = 0; c < 8; ++c) {
                    const auto [x, y, z] = corner(c);
                    inside |= static_cast<unsigned>(value[gridIndex(x, y, z)] < 0.0f) << c;
                }
                if (inside == 0 || inside == 255) continue;
                for (const auto& tetrahedron : kTetrahedra) {
                    // Corners in the order inside first; an odd permutation turns the tetrahedron inside
                    // out.
                    std::array<int, 4> c{tetrahedron[0], tetrahedron[1], tetrahedron[2], tetrahedron[3]};
                    int count = 0;
                    bool flipped = false;
                    for (int a = 0; a < 4; ++a)
                        if (inside >> c[a] & 1u) {
                            for (int b = a; b > count; --b) {
                                std::swap(c[b], c[b - 1]);
                                flipped = !flipped;
                            }
                            ++count;
                        }
                    const auto between = [&](int a, int b) {
                        return vertexBetween(corner(c[a]), corner(c[b]));
                    };
                    const auto triangle = [&](std::uint32_t p, std::uint32_t q, std::uint32_t r) {
                        if (flipped) std::swap(q, r);
                        mesh.triangles.push_back({p, q, r});
                    };
                    if (count == 1) {
                        triangle(between(0, 1), between(0, 2), between(0, 3));
                    } else if (count == 3) {
                        triangle(between(0, 3), between(1, 3), between(2, 3));
                    } else if (count == 2) {
                        const std::uint32_t p = between(0, 2), q = between(0, 3), r = between(1, 3),
                                            s = between(1, 2);
                        triangle(p, q, r);
                        triangle(p, r, s);
                    }
                }
            }
    return mesh;
}

/// The largest connected part. Tips thinner than the grid can come off as crumbs.
Mesh withoutCrumbs(Mesh mesh) {
    std::vector<std::uint32_t> parent(mesh.positions.size());
    std::iota(parent.begin(), parent.end(), 0u);
    const auto root = [&](std::uint32_t v) {
        while (parent[v] != v) v = parent[v] = parent[parent[v]];
        return v;
    };
    for (const auto& t : mesh.triangles)
        for (const std::uint32_t v : {t[1], t[2]}) parent[root(v)] = root(t[0]);
    std::vector<std::uint32_t> faces(mesh.positions.size(), 0);
    for (const auto& t : mesh.triangles) ++faces[root(t[0])];
    const auto largest =
        static_cast<std::uint32_t>(std::max_element(faces.begin(), faces.end()) - faces.begin());
    std::erase_if(mesh.triangles, [&](const auto& t) { return root(t[0]) != largest; });
    return mesh;
}

// --- simplification --------------------------------------------------------------------------------------

/// Sum of squared distances to a set of planes (Garland and Heckbert 1997).
struct Quadric {
    double xx = 0, xy = 0, xz = 0, xw = 0, yy = 0, yz = 0, yw = 0, zz = 0, zw = 0, ww = 0;

    void addPlane(Vec n, double w, double weight) {
        xx += weight * n.x * n.x, xy += weight * n.x * n.y, xz += weight * n.x * n.z, xw += weight * n.x * w;
        yy += weight * n.y * n.y, yz += weight * n.y * n.z, yw += weight * n.y * w;
        zz += weight * n.z * n.z, zw += weight * n.z * w;
        ww += weight * w * w;
    }
    /// Squared distance to a point: pulls the vertex to where it was, along the surface as well.
    void addPoint(Vec p, double weight) {
        addPlane({1, 0, 0}, -p.x, weight);
        addPlane({0, 1, 0}, -p.y, weight);
        addPlane({0, 0, 1}, -p.z, weight);
    }
    Quadric operator+(const Quadric& o) const {
        return {xx + o.xx, xy + o.xy, xz + o.xz, xw + o.xw, yy + o.yy,
                yz + o.yz, yw + o.yw, zz + o.zz, zw + o.zw, ww + o.ww};
    }
    double error(Vec p) const {
        return p.x * (xx * p.x + 2 * (xy * p.y + xz * p.z + xw)) + p.y * (yy * p.y + 2 * (yz * p.z + yw)) +
               p.z * (zz * p.z + 2 * zw) + ww;
    }
    /// The point of least error; false where planes do not determine one.
    bool best(Vec& p) const {
        const double a = yy * zz - yz * yz, b = xz * yz - xy * zz, c = xy * yz - xz * yy;
        const double det = xx * a + xy * b + xz * c;
        const double size = xx + yy + zz;
        if (!(det > 1e-9 * size * size * size)) return false;
        const double d = xx * zz - xz * xz, e = xy * xz - xx * yz, f = xx * yy - xy * xy;
        p = {-(a * xw + b * yw + c * zw) / det, -(b * xw + d * yw + e * zw) / det,
             -(c * xw + e * yw + f * zw) / det};
        return true;
    }
};

/// Collapses edges, cheapest first, until `target` triangles are left. The mesh must be closed and stays so;
/// an edge is passed over if collapsing it would pinch the surface, turn a face over, or leave a sliver.
class Simplifier {
public:
    explicit Simplifier(Mesh mesh) : mesh_(std::move(mesh)) {
        const std::size_t n = mesh_.positions.size();
        faces_of_.resize(n);
        quadric_.resize(n);
        version_.assign(n, 0);
        alive_.assign(mesh_.triangles.size(), true);
        for (std::uint32_t f = 0; f < mesh_.triangles.size(); ++f) {
            const Vec area = areaVector(mesh_, mesh_.triangles[f]);
            const double size = length(area);
            for (const std::uint32_t v : mesh_.triangles[f]) {
                faces_of_[v].push_back(f);
                if (size > 0.0) {
                    const Vec normal = (1.0 / size) * area;
                    quadric_[v].addPlane(normal, -dot(normal, mesh_.positions[v]), size);
                }
                quadric_[v].addPoint(mesh_.positions[v], 1e-4 * size);
            }
        }
    }

    Mesh reduce(std::size_t target) {
        std::size_t count = mesh_.triangles.size();
        std::size_t count_at_refill = count + 1;
        while (count > target) {
            if (heap_.empty()) {
                // An edge passed over may be collapsible now that its surroundings have changed.
                if (count == count_at_refill)
                    throw std::runtime_error("a mesh cannot be simplified as far as asked for");
                count_at_refill = count;
                for (std::uint32_t v = 0; v < faces_of_.size(); ++v)
                    for (const std::uint32_t w : neighbours(v))
                        if (v < w) push(v, w);
            }
            const Edge edge = heap_.top();
            heap_.pop();
            if (edge.version_a != version_[edge.a] || edge.version_b != version_[edge.b]) continue;
            if (collapse(edge)) count -= 2;
        }
        return compacted();
    }

private:
    struct Edge {
        double cost;
        std::uint32_t a, b;
        std::uint32_t version_a, version_b;
        Vec to;
        /// For a heap with the cheapest on top; ties go by number, so that every run takes the same way.
        bool operator<(const Edge& o) const {
            if (cost != o.cost) return cost > o.cost;
            return a != o.a ? a > o.a : b > o.b;
        }
    };

    std::vector<std::uint32_t> neighbours(std::uint32_t v) const {
        std::vector<std::uint32_t> result;
        for (const std::uint32_t f : faces_of_[v])
            for (const std::uint32_t w : mesh_.triangles[f])
                if (w != v) result.push_back(w);
        std::sort(result.begin(), result.end());
        result.erase(std::unique(result.begin(), result.end()), result.end());
        return result;
    }

    void push(std::uint32_t a, std::uint32_t b) {
        const Quadric q = quadric_[a] + quadric_[b];
        const Vec pa = mesh_.positions[a], pb = mesh_.positions[b];
        Vec to = mix(pa, pb, 0.5);
        Vec best;
        // Far from the edge the least error is that of an ill-conditioned system, not of a better shape.
        if (q.best(best) && length(best - to) < 2.0 * length(pb - pa)) to = best;
        heap_.push({std::max(q.error(to), 0.0), a, b, version_[a], version_[b], to});
    }

    /// Twice the area over the squared longest edge, 0.87 for an equilateral triangle.
    static double shape(const std::array<Vec, 3>& corner) {
        double longest2 = 0.0;
        for (int i = 0; i < 3; ++i) {
            const Vec e = corner[(i + 1) % 3] - corner[i];
            longest2 = std::max(longest2, dot(e, e));
        }
        return longest2 > 0.0 ? length(areaVector(corner)) / longest2 : 0.0;
    }

    /// Whether the faces of `v`, but for those with `other`, keep their side and a reasonable shape when v
    /// moves.
    bool facesSurvive(std::uint32_t v, std::uint32_t other, Vec to) const {
        for (const std::uint32_t f : faces_of_[v]) {
            const auto& t = mesh_.triangles[f];
            if (t[0] == other || t[1] == other || t[2] == other) continue;
            const std::array<Vec, 3> before{mesh_.positions[t[0]], mesh_.positions[t[1]],
                                            mesh_.positions[t[2]]};
            std::array<Vec, 3> after = before;
            for (int i = 0; i < 3; ++i)
                if (t[i] == v) after[i] = to;
            // Polygonisation leaves slivers; they may get better only slowly and their normal says little.
            const double old_shape = shape(before), new_shape = shape(after);
            if (new_shape < std::min(0.1, 0.7 * old_shape)) return false;
            const Vec n0 = areaVector(before), n1 = areaVector(after);
            if (old_shape > 0.01 && dot(n0, n1) <= 0.3 * length(n0) * length(n1)) return false;
        }
        return true;
    }

    bool collapse(const Edge& edge) {
        const std::uint32_t a = edge.a, b = edge.b;
        // On a closed surface the two ends of an edge share exactly two neighbours; with more, the collapse
        // pinches it.
        const std::vector<std::uint32_t> around_a = neighbours(a), around_b = neighbours(b);
        std::vector<std::uint32_t> shared;
        std::set_intersection(around_a.begin(), around_a.end(), around_b.begin(), around_b.end(),
                              std::back_inserter(shared));
        if (shared.size() != 2) return false;
        for (const std::uint32_t v : shared)
            if (faces_of_[v].size() <= 3) return false;
        // Where the best point would spoil a face, the middle or one of the ends may not.
        const Vec pa = mesh_.positions[a], pb = mesh_.positions[b];
        const std::array<Vec, 4> choices{edge.to, mix(pa, pb, 0.5), pa, pb};
        const auto to = std::find_if(choices.begin(), choices.end(),
                                     [&](Vec p) { return facesSurvive(a, b, p) && facesSurvive(b, a, p); });
        if (to == choices.end()) return false;

        mesh_.positions[a] = *to;
        quadric_[a] = quadric_[a] + quadric_[b];
        ++version_[b];
        for (const std::uint32_t f : faces_of_[b]) {
            auto& t = mesh_.triangles[f];
            if (t[0] == a || t[1] == a || t[2] == a) {
                alive_[f] = false;
                for (const std::uint32_t v : t)
                    if (v != b) std::erase(faces_of_[v], f);
            } else {
                for (std::uint32_t& v : t)
                    if (v == b) v = a;
                faces_of_[a].push_back(f);
            }
        }
        faces_of_[b].clear();
        ++version_[a];
        for (const std::uint32_t w : neighbours(a)) push(a, w);
        return true;
    }

    /// Without what was removed, in the order of first use.
    Mesh compacted() const {
        Mesh result;
        std::vector<std::uint32_t> number(mesh_.positions.size(), UINT32_MAX);
        for (std::size_t f = 0; f < mesh_.triangles.size(); ++f) {
            if (!alive_[f]) continue;
            std::array<std::uint32_t, 3> t = mesh_.triangles[f];
            for (std::uint32_t& v : t) {
                if (number[v] == UINT32_MAX) {
                    number[v] = static_cast<std::uint32_t>(result.positions.size());
                    result.positions.push_back(mesh_.positions[v]);
                }
                v = number[v];
            }
            result.triangles.push_back(t);
        }
        return result;
    }

    Mesh mesh_;
    std::vector<std::vector<std::uint32_t>> faces_of_;
    std::vector<Quadric> quadric_;
    std::vector<std::uint32_t>
        version_;  ///< Counts the changes of a vertex; edges in the heap from before are stale.
    std::vector<bool> alive_;
    std::priority_queue<Edge> heap_;
};

// --- sphere and prism ------------------------------------------------------------------------------------

Mesh sphere(std::uint32_t segments, std::uint32_t rings) {
    Mesh mesh;
    const auto add = [&](Vec n) {
        mesh.normals.push_back(n);
        mesh.positions.push_back(0.5 * n + Vec{0, 0.5, 0});
    };
    add({0, 1, 0});
    for (std::uint32_t ring = 1; ring < rings; ++ring)
        for (std::uint32_t segment = 0; segment < segments; ++segment) {
            const double theta = kPi * ring / rings, phi = 2.0 * kPi * segment / segments;
            add({std::sin(theta) * std::cos(phi), std::cos(theta), std::sin(theta) * std::sin(phi)});
        }
    add({0, -1, 0});

    const auto at = [&](std::uint32_t ring, std::uint32_t segment) {
        return 1 + (ring - 1) * segments + segment % segments;
    };
    const std::uint32_t south = 1 + (rings - 1) * segments;
    for (std::uint32_t s = 0; s < segments; ++s) mesh.triangles.push_back({0, at(1, s + 1), at(1, s)});
    for (std::uint32_t ring = 1; ring + 1 < rings; ++ring)
        for (std::uint32_t s = 0; s < segments; ++s) {
            mesh.triangles.push_back({at(ring, s), at(ring, s + 1), at(ring + 1, s + 1)});
            mesh.triangles.push_back({at(ring, s), at(ring + 1, s + 1), at(ring + 1, s)});
        }
    for (std::uint32_t s = 0; s < segments; ++s)
        mesh.triangles.push_back({south, at(rings - 1, s), at(rings - 1, s + 1)});
    return mesh;
}

/// A dispersing prism: equilateral section of height 1 in the xy plane, apex up, two units long in z. Its
/// faces are flat, so it has no normals of its own.
Mesh prism() {
    const double half = 1.0 / std::sqrt(3.0);
    Mesh mesh;
    for (const double z : {-1.0, 1.0}) {
        mesh.positions.push_back({-half, 0, z});
        mesh.positions.push_back({half, 0, z});
        mesh.positions.push_back({0, 1, z});
    }
    mesh.triangles = {{0, 2, 1}, {3, 4, 5}, {0, 1, 4}, {0, 4, 3},
                      {1, 2, 5}, {1, 5, 4}, {2, 0, 3}, {2, 3, 5}};
    return mesh;
}

// --- figure ----------------------------------------------------------------------------------------------

/// An ape sitting on a block of stone and thinking, chin on hand, after the bronze that Hugo Rheinhold made
/// in 1892.
Mesh figure() {
    Field field;
    const auto bone = [&](Vec a, Vec b, double ra, double rb, double blend) {
        field.add(blend, [=](Vec p) { return roundCone(p, a, b, ra, rb); });
    };
    const auto ball = [&](Vec centre, Vec radii, double blend) {
        field.add(blend, [=](Vec p) { return ellipsoid(p, centre, radii); });
    };

    // The stone, and a slab under the feet.
    field.add(0.001, [](Vec p) { return roundBox(p, {0, 0.11, 0.16}, {0.25, 0.14, 0.22}, 0.035); });
    field.add(0.03, [](Vec p) { return roundBox(p, {0, 0.0, -0.10}, {0.31, 0.045, 0.40}, 0.02); });

    // Trunk: a heavy pelvis, a rounded back, a deep chest that leans forward.
    ball({0, 0.335, 0.13}, {0.190, 0.130, 0.165}, 0.02);
    bone({0, 0.40, 0.13}, {0, 0.66, 0.02}, 0.165, 0.175, 0.12);
    ball({0, 0.46, 0.00}, {0.150, 0.150, 0.130}, 0.08);
    ball({0, 0.68, 0.06}, {0.215, 0.115, 0.130}, 0.08);

    // Head: thrust forward between the shoulders; brow ridge, muzzle, crest and ears.
    bone({0, 0.74, 0.00}, {0, 0.86, -0.10}, 0.115, 0.095, 0.08);
    ball({0, 0.935, -0.115}, {0.112, 0.118, 0.132}, 0.05);
    ball({0, 0.990, -0.055}, {0.045, 0.062, 0.105}, 0.06);
    bone({-0.062, 0.955, -0.222}, {0.062, 0.955, -0.222}, 0.028, 0.028, 0.03);
    ball({0, 0.862, -0.228}, {0.078, 0.062, 0.072}, 0.04);
    bone({-0.035, 0.838, -0.262}, {0.035, 0.838, -0.262}, 0.030, 0.030, 0.02);
    ball({0, 0.905, -0.265}, {0.030, 0.020, 0.026}, 0.02);
    for (const double side : {-1.0, 1.0}) {
        const auto s = [side](Vec p) { return side < 0.0 ? mirrorX(p) : p; };
        const Vec eye = s({0.043, 0.925, -0.243});
        field.carve(0.02, [eye](Vec p) { return ellipsoid(p, eye, {0.026, 0.018, 0.03}); });
        ball(s({0.043, 0.926, -0.226}), {0.017, 0.014, 0.014}, 0.006);
        const Vec ear = s({0.122, 0.925, -0.09}), hollow = s({0.143, 0.925, -0.102});
        ball(ear, {0.020, 0.043, 0.034}, 0.012);
        field.carve(0.01, [hollow](Vec p) { return ellipsoid(p, hollow, {0.014, 0.026, 0.02}); });
        const Vec nostril = s({0.013, 0.897, -0.292});
        field.carve(0.01, [nostril](Vec p) { return ellipsoid(p, nostril, {0.008, 0.007, 0.012}); });
    }
    field.carve(0.008, [](Vec p) {
        return roundCone(p, {-0.055, 0.847, -0.288}, {0.055, 0.847, -0.288}, 0.006, 0.006);
    });

    // Legs: thighs out, knees high, feet flat with a thumb-like great toe.
    for (const double side : {-1.0, 1.0}) {
        const auto s = [side](Vec p) { return side < 0.0 ? mirrorX(p) : p; };
        const Vec knee = side < 0.0 ? Vec{-0.20, 0.43, -0.20} : Vec{0.215, 0.415, -0.18};
        const Vec ankle = s({0.165, 0.10, -0.16});
        bone(s({0.10, 0.33, 0.07}), knee, 0.105, 0.072, 0.05);
        bone(knee, ankle, 0.066, 0.046, 0.03);
        ball(mix(knee, ankle, 0.40) + Vec{0, 0, 0.03}, {0.056, 0.090, 0.056}, 0.04);
        bone(ankle, s({0.17, 0.072, -0.12}), 0.044, 0.040, 0.02);
        bone(ankle + Vec{0, -0.02, 0}, s({0.185, 0.068, -0.30}), 0.044, 0.038, 0.03);
        for (int toe = 0; toe < 4; ++toe) {
            const double x = 0.162 + 0.024 * toe;
            bone(s({x, 0.068, -0.29}), s({x + 0.004 * toe, 0.058, -0.365 + 0.008 * toe}), 0.016, 0.014,
                 0.012);
        }
        bone(s({0.15, 0.068, -0.25}), s({0.108, 0.060, -0.315}), 0.020, 0.016, 0.015);
    }

    // Its right arm: elbow on the knee, hand under the chin.
    const Vec right_elbow{-0.205, 0.520, -0.215}, right_wrist{-0.085, 0.745, -0.285};
    bone({-0.215, 0.69, 0.03}, right_elbow, 0.088, 0.058, 0.06);
    bone(right_elbow, right_wrist, 0.058, 0.038, 0.03);
    ball(mix(right_elbow, right_wrist, 0.35) + Vec{-0.015, 0, 0}, {0.058, 0.085, 0.058}, 0.03);
    bone(right_wrist, {-0.035, 0.790, -0.285}, 0.038, 0.034, 0.02);
    for (int finger = 0; finger < 4; ++finger) {
        const Vec knuckle{-0.020 + 0.004 * finger, 0.802 - 0.019 * finger, -0.300 + 0.002 * finger};
        bone(knuckle + Vec{-0.03, -0.004, 0.004}, knuckle + Vec{0.022, 0, 0.002}, 0.015, 0.014, 0.010);
        bone(knuckle + Vec{0.022, 0, 0.002}, knuckle + Vec{0.018, -0.004, 0.038}, 0.014, 0.012, 0.008);
    }
    bone({-0.065, 0.785, -0.270}, {-0.088, 0.842, -0.262}, 0.018, 0.014, 0.015);

    // Its left arm: hanging over the other knee.
    const Vec left_elbow{0.325, 0.500, -0.085}, left_wrist{0.235, 0.465, -0.300};
    bone({0.215, 0.69, 0.03}, left_elbow, 0.088, 0.058, 0.06);
    bone(left_elbow, left_wrist, 0.057, 0.038, 0.03);
    ball(mix(left_elbow, left_wrist, 0.35) + Vec{0.01, 0.008, 0}, {0.058, 0.056, 0.085}, 0.03);
    bone(left_wrist, {0.215, 0.425, -0.345}, 0.037, 0.036, 0.02);
    for (int finger = 0; finger < 4; ++finger) {
        const Vec knuckle{0.247 - 0.023 * finger, 0.408, -0.362 + 0.003 * finger};
        bone(knuckle + Vec{0, 0.02, 0.01}, knuckle + Vec{0, -0.05, -0.006}, 0.0155, 0.0145, 0.010);
        bone(knuckle + Vec{0, -0.05, -0.006}, knuckle + Vec{0, -0.092, 0.012}, 0.0145, 0.012, 0.008);
    }
    bone({0.195, 0.43, -0.325}, {0.160, 0.375, -0.318}, 0.018, 0.014, 0.015);

    Mesh mesh =
        Simplifier(withoutCrumbs(polygonise(field, {-0.45, -0.03, -0.56}, {0.47, 1.14, 0.45}, 0.010)))
            .reduce(4746);
    // A closed surface has an even number of triangles. The 4,745th is the last one: the lowest face of the
    // slab, on which everything stands, is left open by the one triangle that no camera here sees.
    const auto lowest =
        std::min_element(mesh.triangles.begin(), mesh.triangles.end(), [&](const auto& a, const auto& b) {
            const auto height = [&](const auto& t) {
                return mesh.positions[t[0]].y + mesh.positions[t[1]].y + mesh.positions[t[2]].y;
            };
            return height(a) < height(b);
        });
    mesh.triangles.erase(lowest);
    normalise(mesh);
    addNormals(mesh);
    return mesh;
}

// --- dragon ----------------------------------------------------------------------------------------------

/// A curve through points with a radius at each: Catmull and Rom's spline, cut into short straight pieces.
struct Spine {
    struct Knot {
        Vec at;
        double radius;
    };
    std::vector<Knot> knots;

    Spine(const std::vector<Knot>& through, int pieces) {
        const auto get = [&](std::size_t i, int offset) {
            const int j = static_cast<int>(i) + offset, last = static_cast<int>(through.size()) - 1;
            return through[static_cast<std::size_t>(std::clamp(j, 0, last))];
        };
        for (std::size_t i = 0; i + 1 < through.size(); ++i)
            for (int s = 0; s < pieces; ++s)
                knots.push_back(
                    blend(get(i, -1), get(i, 0), get(i, 1), get(i, 2), static_cast<double>(s) / pieces));
        knots.push_back(through.back());
    }

    Vec tangent(std::size_t i) const {
        return unit(knots[std::min(i + 1, knots.size() - 1)].at - knots[i > 0 ? i - 1 : 0].at);
    }
    /// Away from the belly: what is left of "up" across the curve.
    Vec up(std::size_t i) const {
        const Vec t = tangent(i);
        return unit(Vec{0, 1, 0} - t.y * t);
    }

private:
    static Knot blend(Knot a, Knot b, Knot c, Knot d, double t) {
        const double wa = 0.5 * t * (t * (2 - t) - 1), wb = 0.5 * (t * t * (3 * t - 5) + 2);
        const double wc = 0.5 * t * (t * (4 - 3 * t) + 1), wd = 0.5 * t * t * (t - 1);
        return {wa * a.at + wb * b.at + (wc * c.at + wd * d.at),
                std::max(0.004, wa * a.radius + wb * b.radius + wc * c.radius + wd * d.radius)};
    }
};

/// Height of the scales, 0 to 1, at a place on the skin: `around` counts scales round the body, `along` rows
/// towards the tail. Rows are shifted by half a scale, and each scale rises towards its free end.
double scaleHeight(double around, double along) {
    const double a = around + 0.5 * along, b = around - 0.5 * along;
    const double x = a - std::floor(a) - 0.5, y = b - std::floor(b) - 0.5;
    return (1 - 4 * x * x) * (1 - 4 * y * y) * (0.7 + 0.6 * (x - y));
}

/// A winged dragon, half coiled, head turned to the viewer. Long and thin in every direction, and as fine in
/// its scales as it is coarse on its wings.
Mesh dragon() {
    Field field;
    const auto bone = [&](Vec a, Vec b, double ra, double rb, double blend) {
        field.add(blend, [=](Vec p) { return roundCone(p, a, b, ra, rb); });
    };
    const auto ball = [&](Vec centre, Vec radii, double blend) {
        field.add(blend, [=](Vec p) { return ellipsoid(p, centre, radii); });
    };

    // Body from the nape to the tip of the tail.
    const Spine spine({{{-0.640, 0.800, -0.170}, 0.066},
                       {{-0.590, 0.735, -0.100}, 0.070},
                       {{-0.525, 0.600, -0.020}, 0.082},
                       {{-0.400, 0.465, 0.040}, 0.112},
                       {{-0.205, 0.415, 0.060}, 0.158},
                       {{0.020, 0.405, 0.040}, 0.160},
                       {{0.240, 0.395, -0.010}, 0.145},
                       {{0.430, 0.345, -0.070}, 0.112},
                       {{0.610, 0.240, -0.080}, 0.086},
                       {{0.780, 0.135, -0.010}, 0.068},
                       {{0.870, 0.082, 0.150}, 0.055},
                       {{0.800, 0.062, 0.310}, 0.046},
                       {{0.620, 0.056, 0.390}, 0.038},
                       {{0.420, 0.050, 0.370}, 0.031},
                       {{0.270, 0.046, 0.290}, 0.024},
                       {{0.170, 0.050, 0.330}, 0.017},
                       {{0.120, 0.075, 0.410}, 0.010}},
                      5);
    constexpr int kScalesAround = 22;
    double rows =
        0.0;  // Scales keep their shape as the body thins, so rows are counted in units of its girth.
    for (std::size_t i = 0; i + 1 < spine.knots.size(); ++i) {
        const Spine::Knot a = spine.knots[i], b = spine.knots[i + 1];
        const double rows_a = rows;
        rows += length(b.at - a.at) * kScalesAround / (2.0 * kPi * 0.5 * (a.radius + b.radius)) * 0.9;
        const double rows_b = rows;
        const Vec up_a = spine.up(i), up_b = spine.up(i + 1);
        field.add(0.012, [=](Vec p) {
            const double d = roundCone(p, a.at, b.at, a.radius, b.radius);
            const Vec along = b.at - a.at;
            const double t = std::clamp(dot(p - a.at, along) / dot(along, along), 0.0, 1.0);
            const Vec out = p - mix(a.at, b.at, t), up = mix(up_a, up_b, t);
            const double above = dot(out, up), beside = dot(out, cross(unit(along), up));
            const double angle = std::atan2(beside, above), radius = a.radius + t * (b.radius - a.radius);
            const double row = rows_a + t * (rows_b - rows_a);
            // Scales on back and flanks, plates across the belly.
            const double belly = std::clamp(3.0 * (-std::cos(angle) - 0.62), 0.0, 1.0);
            const double plate = std::abs(std::sin(0.5 * kPi * row));
            const double scale = scaleHeight(angle * kScalesAround / (2 * kPi), row);
            const double height = (1 - belly) * scale + belly * 0.8 * std::sqrt(plate);
            return d - 0.085 * radius * (height - 0.3);
        });
    }

    // A crest of spikes down the back, largest over the shoulders.
    for (std::size_t i = 3; i + 6 < spine.knots.size(); i += 2) {
        const Spine::Knot k = spine.knots[i];
        const Vec up = spine.up(i), back = spine.tangent(i);
        const double size = 0.35 * k.radius + 0.018;
        const Vec root = k.at + (0.92 * k.radius) * up;
        bone(root - (0.5 * size) * back, root + size * up + (0.9 * size) * back, 0.30 * size,
             0.06 * size + 0.002, 0.012);
        bone(root + (0.4 * size) * back, root + size * up + (0.9 * size) * back, 0.26 * size,
             0.06 * size + 0.002, 0.008);
    }
    // The tail ends in a blade.
    const Vec tip = spine.knots.back().at;
    const Vec blade_root = tip + Vec{0.02, -0.02, -0.01}, blade_end = tip + Vec{-0.035, 0.11, 0.07};
    for (const Vec& corner : {tip + Vec{-0.055, 0.03, 0.03}, tip + Vec{0.05, 0.055, 0.06}})
        field.add(0.01, [=](Vec p) { return membrane(p, blade_root, corner, blade_end, 0.007); });

    // Head, in its own frame: `f` forward along the snout, `u` up, `s` to its left.
    const Vec head{-0.665, 0.845, -0.200};
    const Vec f = unit({-0.62, -0.22, -0.75}), s = unit(cross({0, 1, 0}, f)), u = cross(f, s);
    const auto place = [=](double forward, double up, double side) {
        return head + forward * f + up * u + side * s;
    };
    bone(place(-0.03, -0.005, 0), place(0.06, 0.0, 0), 0.074, 0.062, 0.05);
    bone(place(0.05, 0.006, 0), place(0.205, -0.004, 0), 0.050, 0.034, 0.03);         // Upper jaw.
    bone(place(0.01, -0.050, 0), place(0.180, -0.098, 0), 0.042, 0.022, 0.02);        // Lower jaw, open.
    ball(place(0.214, 0.006, 0), {0.030, 0.024, 0.032}, 0.025);
    bone(place(0.09, -0.048, 0), place(0.170, -0.060, 0), 0.012, 0.006, 0.01);        // Tongue.
    for (const double side : {-1.0, 1.0}) {
        bone(place(0.02, 0.052, side * 0.036), place(0.105, 0.040, side * 0.030), 0.018, 0.010,
             0.015);                                                            // Brow.
        ball(place(0.070, 0.027, side * 0.051), {0.017, 0.017, 0.017}, 0.004);  // Eye.
        const Vec nostril = place(0.234, 0.022, side * 0.016);
        field.carve(0.006, [nostril](Vec p) { return length(p - nostril) - 0.009; });
        // Horns in three pieces that turn back and up, and two smaller ones below.
        const Vec h0 = place(-0.045, 0.045, side * 0.042), h1 = place(-0.125, 0.085, side * 0.074);
        const Vec h2 = place(-0.205, 0.125, side * 0.082), h3 = place(-0.270, 0.195, side * 0.070);
        bone(h0, h1, 0.024, 0.020, 0.015);
        bone(h1, h2, 0.020, 0.014, 0.01);
        bone(h2, h3, 0.014, 0.004, 0.01);
        bone(place(-0.040, -0.010, side * 0.062), place(-0.120, -0.005, side * 0.120), 0.018, 0.004, 0.012);
        bone(place(-0.030, -0.045, side * 0.050), place(-0.085, -0.075, side * 0.095), 0.014, 0.004, 0.012);
        for (int tooth = 0; tooth < 6; ++tooth) {
            const double forward = 0.085 + 0.024 * tooth, out = side * (0.036 - 0.0024 * tooth);
            const double fang = tooth == 4 ? 1.8 : 1.0;
            bone(place(forward, -0.018, out), place(forward + 0.003, -0.030 - 0.022 * fang, out), 0.0100,
                 0.0035, 0.004);
            const double jaw = -0.052 - 0.29 * (forward - 0.085);
            bone(place(forward - 0.015, jaw - 0.008, 0.75 * out),
                 place(forward - 0.013, jaw + 0.026, 0.75 * out), 0.0095, 0.0035, 0.004);
        }
    }

    // Legs: shoulder or hip, knee, ankle, foot, four claws.
    const auto leg = [&](Vec hip, Vec knee, Vec ankle, Vec foot, double r) {
        ball(mix(hip, knee, 0.25), {1.25 * r, 1.5 * r, 1.1 * r}, 0.04);
        bone(hip, knee, 1.15 * r, 0.72 * r, 0.04);
        bone(knee, ankle, 0.70 * r, 0.45 * r, 0.02);
        bone(ankle, foot, 0.46 * r, 0.42 * r, 0.015);
        const Vec forward = unit(Vec{foot.x - ankle.x, 0, foot.z - ankle.z}),
                  across = cross({0, 1, 0}, forward);
        for (int toe = -1; toe <= 2; ++toe) {
            const bool spur = toe == 2;
            const Vec direction = spur ? (-1.0) * forward : unit(forward + (0.55 * toe) * across);
            const Vec start = spur ? Vec{ankle.x, 0.03, ankle.z} : foot;
            const Vec knuckle = start + (0.75 * r) * direction + Vec{0, 0.012, 0};
            const Vec end{knuckle.x + 0.55 * r * direction.x, 0.018, knuckle.z + 0.55 * r * direction.z};
            bone(start, knuckle, 0.30 * r, 0.26 * r, 0.012);
            bone(knuckle, end, 0.26 * r, 0.20 * r, 0.008);
            bone(end, {end.x + 0.5 * r * direction.x, 0.004, end.z + 0.5 * r * direction.z}, 0.16 * r,
                 0.02 * r, 0.006);
        }
    };
    leg({-0.270, 0.370, -0.080}, {-0.235, 0.235, -0.235}, {-0.255, 0.075, -0.200}, {-0.320, 0.030, -0.255},
        0.072);
    leg({-0.250, 0.370, 0.190}, {-0.170, 0.230, 0.300}, {-0.235, 0.075, 0.275}, {-0.305, 0.030, 0.295},
        0.072);
    leg({0.235, 0.360, -0.130}, {0.130, 0.270, -0.290}, {0.295, 0.105, -0.270}, {0.245, 0.030, -0.335},
        0.090);
    leg({0.260, 0.360, 0.110}, {0.150, 0.255, 0.240}, {0.305, 0.105, 0.215}, {0.245, 0.030, 0.235}, 0.090);

    // Wings, raised: arm, wrist with a claw, four fingers, and skin between them that hangs in arcs.
    for (const double side : {-1.0, 1.0}) {
        const auto w = [side](Vec p) { return (side < 0.0 ? p : mirrorZ(p)) + Vec{0, 0, 0.05}; };
        const Vec shoulder = w({-0.200, 0.525, -0.085}), elbow = w({-0.060, 0.755, -0.185}),
                  wrist = w({-0.235, 0.985, -0.300});
        const std::array<Vec, 5> tip_of{w({-0.120, 1.120, -0.560}), w({0.190, 1.090, -0.600}),
                                        w({0.420, 0.915, -0.520}), w({0.500, 0.680, -0.370}),
                                        w({0.330, 0.505, -0.115})};
        bone(shoulder, elbow, 0.052, 0.030, 0.03);
        bone(elbow, wrist, 0.032, 0.022, 0.012);
        bone(wrist, wrist + Vec{-0.055, 0.055, 0.0}, 0.014, 0.003, 0.01);
        for (std::size_t i = 0; i < 4; ++i) {
            const Vec middle = mix(wrist, tip_of[i], 0.5) + Vec{0, 0.030, 0};  // Fingers bend a little.
            bone(wrist, middle, 0.017, 0.012, 0.008);
            bone(middle, tip_of[i], 0.012, 0.004, 0.006);
        }
        constexpr double kSkin = 0.0075;
        const auto skin = [&](Vec a, Vec b, Vec c) {
            field.add(0.008, [=](Vec p) { return membrane(p, a, b, c, kSkin); });
        };
        for (std::size_t i = 0; i + 1 < tip_of.size(); ++i) {
            // The last tip is where the skin meets the flank; before it the skin hangs from the arm instead
            // of a finger.
            const Vec pa = mix(wrist, tip_of[i], 0.5) + Vec{0, 0.030, 0};
            const Vec pb = i == 3 ? elbow : mix(wrist, tip_of[i + 1], 0.5) + Vec{0, 0.030, 0};
            const Vec rim = mix(mix(tip_of[i], tip_of[i + 1], 0.5), i == 3 ? elbow : wrist, 0.22);
            skin(wrist, pa, pb);
            skin(pa, rim, pb);
            skin(pa, tip_of[i], rim);
            skin(pb, rim, tip_of[i + 1]);
        }
        skin(elbow, tip_of[4], w({0.060, 0.480, -0.090}));
        skin(elbow, w({0.060, 0.480, -0.090}), shoulder);
    }

    Mesh mesh =
        Simplifier(withoutCrumbs(polygonise(field, {-1.00, -0.03, -0.72}, {1.00, 1.20, 0.80}, 0.0066)))
            .reduce(100000);
    normalise(mesh);
    addNormals(mesh);
    return mesh;
}

}  // namespace

int main(int argc, char** argv) {
    const std::string argument = argc == 2 ? argv[1] : "";
    const bool asks_for_help = argument == "--help" || argument == "-h";
    if (argument.empty() || argument[0] == '-') {
        std::fprintf(asks_for_help ? stdout : stderr,
                     "usage: crt-meshgen OUTDIR\nWrites sphere.obj, ball.obj, figure.obj, dragon.obj and "
                     "prism.obj into the folder OUTDIR, which is made if need be.\n");
        return asks_for_help ? 0 : 2;
    }
    try {
        const std::filesystem::path folder = argument;
        std::filesystem::create_directories(folder);
        writeObj(sphere(32, 16), folder / "sphere.obj", "sphere of 32 segments and 16 rings");
        writeObj(sphere(128, 64), folder / "ball.obj", "sphere of 128 segments and 64 rings");
        writeObj(prism(), folder / "prism.obj", "60 degree prism");
        writeObj(figure(), folder / "figure.obj", "ape, thinking");
        writeObj(dragon(), folder / "dragon.obj", "dragon");
    } catch (const std::exception& error) {
        std::fprintf(stderr, "crt-meshgen: %s\n", error.what());
        return 6;
    }
    return 0;
}
