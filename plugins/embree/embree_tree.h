/// A tree of boxes over a blob's slots, eight children a node, built by Embree and traversed by traversal.h.
#pragma once

#include "tile_job.h"
// Behind tile_job.h, which says what a context carries.
#include "kernel/geometry/surface.h"

#include <functional>
#include <memory>
#include <string>

namespace crt::embree {

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
