/// A tree of boxes over a blob's slots, eight children a node, built by Embree and traversed by traversal.h.
#pragma once

namespace crt::embree {
class Tree;
}
// The kernels of this backend carry the tree along, and trace with it (kernels.cpp).
#define CRT_CONTEXT_EXTRA const crt::embree::Tree* tree;
#define CRT_BACKEND_TRACE
#include "kernel/geometry/surface.h"

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

namespace crt::embree {

/// The address of a Node8; that of a Leaf8, marked; or a slot that holds no triangle. Addresses are
/// multiples of 64.
using Child = std::uintptr_t;
inline constexpr Child kLeaf = 1, kSlot = 2, kMarks = 63;
inline constexpr unsigned kSlotShift = 6;

struct alignas(64) Node8 {
    float bounds[6][8];  ///< Lower x, upper x, lower y, … of each child; of those that are not, empty.
    Child child[8];
};
static_assert(sizeof(Node8) == 256);

/// Eight triangles side by side. Where there is none the coordinates are NaN, which no ray hits.
struct alignas(64) Leaf8 {
    float p[9][8];  ///< CrtTriangle::p of each.
    std::uint32_t slot[8];
};
static_assert(sizeof(Leaf8) == 320);

/// Of nodes: Embree's, and one of slots.
inline constexpr std::uint32_t kMostLevels = 33;

/// One Embree device; its trees must not outlive it.
class Device {
public:
    /// It works with as many threads as TBB may use. Throws PluginError(CRT_NO_DEVICE) with Embree's reason.
    Device();
    ~Device();
    Device(const Device&) = delete;
    Device& operator=(const Device&) = delete;

    /// "3.13.5"
    static std::string version();

private:
    friend class Tree;
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

class Tree {
public:
    /// Of the slots of a blob, which it does not need afterwards. `progress` gets the part that is built, in
    /// [0,1], from any thread. Throws PluginError when Embree cannot build it.
    Tree(const Device& device, const unsigned char* blob, const std::function<void(double)>& progress);
    ~Tree();
    Tree(const Tree&) = delete;
    Tree& operator=(const Tree&) = delete;

    Child root() const { return root_; }

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
    Child root_ = 0;
};

}  // namespace crt::embree
