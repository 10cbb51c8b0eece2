/// The blob's triangles and shapes in an Embree scene. Embree finds candidates; the kernel's shared tests
/// have the last word, so that hits are the same bits as on every other backend. The one file pair that
/// knows Embree, and hides the difference between Embree 3 and 4.
#pragma once

namespace crt::embree {
class Tracer;
}
// The kernels of this backend carry the tracer along, and trace with it (kernels.cpp).
#define CRT_CONTEXT_EXTRA const crt::embree::Tracer* tracer;
#define CRT_BACKEND_TRACE
#include "kernel/surface.h"

#include <functional>
#include <memory>
#include <string>

namespace crt::embree {

/// One Embree device; its scenes must not outlive it.
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
    friend class Tracer;
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

/// An Embree BVH over the slots of a blob, which it reads while it lives. Throws PluginError when Embree
/// cannot build it.
class Tracer {
public:
    /// `progress` gets the part of it that is built, in [0,1], from any thread.
    Tracer(const Device& device, const unsigned char* blob, const std::function<void(double)>& progress);
    ~Tracer();
    Tracer(const Tracer&) = delete;
    Tracer& operator=(const Tracer&) = delete;

    /// The same blob lies there from now on.
    void moveTo(const unsigned char* blob);

    /// Rays that start within this of 0 on each axis are taken.
    static constexpr float kReach = 4;
    /// Whether Embree is sure to find what this ray meets: not for rays from far outside the scene, and
    /// those that are none.
    static bool takes(const kernel::CrtRay& ray);
    kernel::CrtHit closest(const kernel::CrtRay& ray) const;
    bool any(const kernel::CrtRay& ray) const;

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace crt::embree
