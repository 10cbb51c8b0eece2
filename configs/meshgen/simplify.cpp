#include "simplify.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <queue>
#include <vector>

namespace crt::meshgen {

namespace {

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

    /// Where an edge becomes one vertex, by the quadric of both ends.
    Vec placeOf(const Quadric& q, std::uint32_t a, std::uint32_t b) const {
        const Vec pa = mesh_.positions[a], pb = mesh_.positions[b], middle = mix(pa, pb, 0.5);
        Vec best;
        // Far from the edge the least error is that of an ill-conditioned system, not of a better shape.
        return q.best(best) && length(best - middle) < 2.0 * length(pb - pa) ? best : middle;
    }

    void push(std::uint32_t a, std::uint32_t b) {
        const Quadric q = quadric_[a] + quadric_[b];
        heap_.push({std::max(q.error(placeOf(q, a, b)), 0.0), a, b, version_[a], version_[b]});
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

    /// True if the faces of `v`, but for those with `other`, keep their side and a reasonable shape when v
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
        const std::array<Vec, 4> choices{placeOf(quadric_[a] + quadric_[b], a, b), mix(pa, pb, 0.5), pa, pb};
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

}  // namespace

Mesh simplified(Mesh mesh, std::size_t target) { return Simplifier(std::move(mesh)).reduce(target); }

}  // namespace crt::meshgen
