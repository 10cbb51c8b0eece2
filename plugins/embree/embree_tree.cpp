// The one file that knows Embree, and hides the difference between Embree 3 and 4.
#include "embree_tree.h"

#include "backend/sdk/plugin_guard.h"

#if defined(CRT_EMBREE_MAJOR) && CRT_EMBREE_MAJOR >= 4
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

#include <algorithm>
#include <limits>

#include <tbb/parallel_for.h>

namespace crt::embree {
namespace {

using kernel::CrtTriangle;
using kernel::u64;  // CRT_ARRAY computes with it

constexpr unsigned kLanes = 8;

std::string errorText(RTCDevice device, const char* what) {
    const RTCError code = rtcGetDeviceError(device);
    return std::string(what) + " (Embree error " + std::to_string(static_cast<int>(code)) + ")";
}

/// The leaf of children that are not there: a ray whose distances overflow enters them too.
const Leaf8& nothing() {
    static const Leaf8 leaf = [] {
        Leaf8 empty;
        for (auto& row : empty.p) std::fill_n(row, kLanes, std::numeric_limits<float>::quiet_NaN());
        std::fill_n(empty.slot, kLanes, CRT_NONE);
        return empty;
    }();
    return leaf;
}

/// The nodes that Embree returns to the functions below.
struct Building {
    const CrtTriangle* triangles;
    const std::function<void(double)>* progress;
};

/// Of a triangle, or of a shape's or an instance's box, which stands in its place.
RTCBuildPrimitive primitiveOf(const CrtTriangle& triangle, std::size_t slot) {
    const auto bound = [&](std::uint32_t axis, float& lower, float& upper) {
        const float* p = triangle.p + 3 * axis;
        lower = std::min({p[0], p[1], p[2]}) - CRT_BOX_PADDING;
        upper = std::max({p[0], p[1], p[2]}) + CRT_BOX_PADDING;
    };
    RTCBuildPrimitive b{};
    bound(0, b.lower_x, b.upper_x);
    bound(1, b.lower_y, b.upper_y);
    bound(2, b.lower_z, b.upper_z);
    b.primID = static_cast<unsigned>(slot);
    return b;
}

/// Children that are not set have boxes that no ray enters.
void* createNode(RTCThreadLocalAllocator allocator, unsigned, void*) {
    auto* node = static_cast<Node8*>(rtcThreadLocalAlloc(allocator, sizeof(Node8), alignof(Node8)));
    for (unsigned plane = 0; plane < 6; ++plane)
        std::fill_n(node->bounds[plane], kLanes,
                    (plane & 1u) != 0 ? -std::numeric_limits<float>::infinity()
                                      : std::numeric_limits<float>::infinity());
    std::fill_n(node->child, kLanes, reinterpret_cast<Child>(&nothing()) | kLeaf);
    return node;
}

void setChildren(void* node, void** children, unsigned count, void*) {
    for (unsigned i = 0; i < count; ++i)
        static_cast<Node8*>(node)->child[i] = reinterpret_cast<Child>(children[i]);
}

void setBounds(void* into, const RTCBounds** bounds, unsigned count, void*) {
    auto& planes = static_cast<Node8*>(into)->bounds;
    for (unsigned i = 0; i < count; ++i) {
        const RTCBounds& b = *bounds[i];
        const float values[6] = {b.lower_x, b.upper_x, b.lower_y, b.upper_y, b.lower_z, b.upper_z};
        for (unsigned plane = 0; plane < 6; ++plane) planes[plane][i] = values[plane];
    }
}

Child triangleLeaf(RTCThreadLocalAllocator allocator, const RTCBuildPrimitive* const* primitives,
                   unsigned count, const CrtTriangle* triangles) {
    auto* leaf = static_cast<Leaf8*>(rtcThreadLocalAlloc(allocator, sizeof(Leaf8), alignof(Leaf8)));
    *leaf = nothing();
    for (unsigned lane = 0; lane < count; ++lane) {
        leaf->slot[lane] = primitives[lane]->primID;
        for (unsigned i = 0; i < 9; ++i) leaf->p[i][lane] = triangles[leaf->slot[lane]].p[i];
    }
    return reinterpret_cast<Child>(leaf) | kLeaf;
}

RTCBounds boundsOf(const RTCBuildPrimitive* const* primitives, unsigned count) {
    RTCBounds b{};
    const auto bound = [&](float RTCBuildPrimitive::*from, float RTCBounds::*to, auto&& better) {
        b.*to = primitives[0]->*from;
        for (unsigned i = 1; i < count; ++i) b.*to = better(b.*to, primitives[i]->*from);
    };
    const auto least = [](float x, float y) { return std::min(x, y); };
    const auto most = [](float x, float y) { return std::max(x, y); };
    bound(&RTCBuildPrimitive::lower_x, &RTCBounds::lower_x, least);
    bound(&RTCBuildPrimitive::lower_y, &RTCBounds::lower_y, least);
    bound(&RTCBuildPrimitive::lower_z, &RTCBounds::lower_z, least);
    bound(&RTCBuildPrimitive::upper_x, &RTCBounds::upper_x, most);
    bound(&RTCBuildPrimitive::upper_y, &RTCBounds::upper_y, most);
    bound(&RTCBuildPrimitive::upper_z, &RTCBounds::upper_z, most);
    return b;
}

/// The triangles as a leaf, and each other slot, with a separate box, as another leaf: a ray that meets its
/// neighbour must not enter an instance. Where there are several of these, a node holds them.
void* createLeaf(RTCThreadLocalAllocator allocator, const RTCBuildPrimitive* primitives, std::size_t count,
                 void* building) {
    const CrtTriangle* triangles = static_cast<const Building*>(building)->triangles;
    const RTCBuildPrimitive *of_leaf[kLanes], *others[kLanes];
    unsigned in_leaf = 0, other_count = 0;
    for (std::size_t i = 0; i < count; ++i)
        if (triangles[primitives[i].primID].shape == 0)
            of_leaf[in_leaf++] = primitives + i;
        else
            others[other_count++] = primitives + i;

    void* children[kLanes];
    RTCBounds bounds[kLanes];
    unsigned child_count = 0;
    const auto add = [&](Child child, const RTCBuildPrimitive* const* of, unsigned n) {
        children[child_count] = reinterpret_cast<void*>(child);
        bounds[child_count++] = boundsOf(of, n);
    };
    if (in_leaf > 0) add(triangleLeaf(allocator, of_leaf, in_leaf, triangles), of_leaf, in_leaf);
    for (unsigned i = 0; i < other_count; ++i)
        add(Child{others[i]->primID} << kSlotShift | kSlot, others + i, 1);
    if (child_count == 1) return children[0];

    void* node = createNode(allocator, child_count, building);
    const RTCBounds* pointers[kLanes];
    for (unsigned i = 0; i < child_count; ++i) pointers[i] = bounds + i;
    setChildren(node, children, child_count, building);
    setBounds(node, pointers, child_count, building);
    return node;
}

/// Called by Embree's threads while it builds; true means to go on.
bool reportProgress(void* building, double done) {
    (*static_cast<const Building*>(building)->progress)(done);
    return true;
}

}  // namespace

struct Device::Impl {
    RTCDevice device = nullptr;
};

Device::Device() : impl_(new Impl) {
    // No "threads=": Embree would limit the whole process to that many, and to the number of processors. The
    // caller's limit holds for it as well.
    impl_->device = rtcNewDevice(nullptr);
    if (impl_->device == nullptr)
        throw plugin::PluginError(CRT_NO_DEVICE, errorText(nullptr, "Embree could not be started"));
}

Device::~Device() { rtcReleaseDevice(impl_->device); }

std::string Device::version() {
    return std::to_string(RTC_VERSION_MAJOR) + "." + std::to_string(RTC_VERSION_MINOR) + "." +
           std::to_string(RTC_VERSION_PATCH);
}

struct Tree::Impl {
    RTCBVH bvh = nullptr;
    ~Impl() { rtcReleaseBVH(bvh); }
};

Tree::Tree(const Device& device, const unsigned char* blob, const std::function<void(double)>& progress)
    : impl_(new Impl) {
    const auto& scene = *reinterpret_cast<const kernel::CrtScene*>(blob);
    Building building{CRT_ARRAY(CrtTriangle, blob, scene.triangles), &progress};
    // Not a vector: it would write zeros over hundreds of megabytes first.
    const std::size_t count = scene.triangle_count;
    const std::unique_ptr<RTCBuildPrimitive[]> primitives(new RTCBuildPrimitive[count]);
    tbb::parallel_for(std::size_t{0}, count,
                      [&](std::size_t i) { primitives[i] = primitiveOf(building.triangles[i], i); });
    RTCDevice rtc = device.impl_->device;
    impl_->bvh = rtcNewBVH(rtc);
    RTCBuildArguments arguments = rtcDefaultBuildArguments();
    arguments.bvh = impl_->bvh;
    arguments.maxBranchingFactor = kLanes;
    arguments.maxDepth = kMostLevels - 1;
    arguments.sahBlockSize = kLanes;  // as many are tested in the time of one
    arguments.maxLeafSize = kLanes;
    arguments.primitives = primitives.get();
    arguments.primitiveCount = arguments.primitiveArrayCapacity = count;
    arguments.createNode = createNode;
    arguments.setNodeChildren = setChildren;
    arguments.setNodeBounds = setBounds;
    arguments.createLeaf = createLeaf;
    arguments.buildProgress = reportProgress;
    arguments.userPtr = &building;
    root_ = reinterpret_cast<Child>(rtcBuildBVH(&arguments));
    if (root_ == 0 || rtcGetDeviceError(rtc) != RTC_ERROR_NONE)
        throw plugin::PluginError(CRT_DEVICE_FAILED, errorText(rtc, "Embree could not build its tree"));
}

Tree::~Tree() = default;

}  // namespace crt::embree
