#include "embree_scene.h"

#include "backend/sdk/plugin_guard.h"

#if defined(CRT_EMBREE_MAJOR) && CRT_EMBREE_MAJOR >= 4
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

#include <algorithm>
#include <limits>
#include <new>

namespace crt::embree {
namespace {

using kernel::CrtContext;
using kernel::CrtHit;
using kernel::CrtRay;
using kernel::CrtShear;
using kernel::CrtTriangle;

/// Embree's distances may differ from the shared test's in the last bits: what culls is given this much more
/// reach.
constexpr float kReachSlack = 1.0f + 1e-5f;

/// Embree tests the boxes of user primitives without its robust mode's care: planes err by some 7 · 2^-24
/// of the coordinates that take part, whatever the scene's flags say. For rays that start within
/// Tracer::kReach of the scene (which lies within ±1) this holds what they touch, with room to spare.
constexpr float kBoxPadding = 8 * CRT_BOX_PADDING;

#if RTC_VERSION_MAJOR >= 4
using QueryContext = RTCRayQueryContext;
void initContext(QueryContext* context) { rtcInitRayQueryContext(context); }
#else
using QueryContext = RTCIntersectContext;
void initContext(QueryContext* context) { rtcInitIntersectContext(context); }
#endif

/// What the callbacks need; Embree hands them the context back, which is its first member.
struct Query {
    QueryContext context;
    const CrtTriangle* triangles;
    CrtShear shear;
    CrtHit best;
    float reach;
    const CrtContext* slots;  ///< Null: all slots hold triangles.
    CrtRay ray;
};

/// Tests one triangle whose box the ray meets, and lets Embree go no further than just beyond the best hit,
/// so that ties still come here.
void closestHit(const RTCIntersectFunctionNArguments* arguments) {
    Query& query = *reinterpret_cast<Query*>(arguments->context);
    const float before = query.best.t;
    if (query.slots != nullptr)
        crt_test_slot(query.slots, query.triangles, arguments->primID, query.ray, query.shear, &query.best);
    else
        crt_test_closest(query.triangles, arguments->primID, query.shear, &query.best);
    if (query.best.t < before)
        RTCRayN_tfar(RTCRayHitN_RayN(arguments->rayhit, 1), 1, 0) = query.best.t * kReachSlack;
}

void anyHit(const RTCOccludedFunctionNArguments* arguments) {
    Query& query = *reinterpret_cast<Query*>(arguments->context);
    CrtHit hit;
    const bool stops =
        query.slots != nullptr
            ? crt_slot_stops(query.slots, query.triangles, arguments->primID, query.ray, query.shear, &hit)
            : crt_intersect_triangle(query.triangles + arguments->primID, query.shear, query.reach, &hit);
    if (stops) RTCRayN_tfar(arguments->ray, 1, 0) = -std::numeric_limits<float>::infinity();
}

/// Of a triangle, or of a shape's box, which stands in its place.
void slotBounds(const RTCBoundsFunctionArguments* arguments) {
    const CrtTriangle& triangle =
        static_cast<const CrtTriangle*>(arguments->geometryUserPtr)[arguments->primID];
    const auto bound = [&](std::uint32_t axis, float& lower, float& upper) {
        const float* p = triangle.p + 3 * axis;
        lower = std::min({p[0], p[1], p[2]}) - kBoxPadding;
        upper = std::max({p[0], p[1], p[2]}) + kBoxPadding;
    };
    RTCBounds& b = *arguments->bounds_o;
    bound(0, b.lower_x, b.upper_x);
    bound(1, b.lower_y, b.upper_y);
    bound(2, b.lower_z, b.upper_z);
}

Query makeQuery(const CrtTriangle* triangles, const CrtContext* slots, const CrtRay& ray) {
    Query query;
    initContext(&query.context);
    query.triangles = triangles;
    query.slots = slots;
    query.ray = ray;
    query.shear = crt_shear(ray);
    query.best = kernel::crt_no_hit(ray.reach);
    query.reach = ray.reach;
    return query;
}

RTCRay embreeRay(const CrtRay& ray) {
    RTCRay r;
    r.org_x = ray.o.x;
    r.org_y = ray.o.y;
    r.org_z = ray.o.z;
    r.tnear = 0.0f;
    r.dir_x = ray.d.x;
    r.dir_y = ray.d.y;
    r.dir_z = ray.d.z;
    r.time = 0.0f;
    r.tfar = ray.reach * kReachSlack;
    r.mask = 0xffffffffu;
    r.id = 0;
    r.flags = 0;
    return r;
}

/// Called by Embree's threads while it builds; true means to go on.
bool reportProgress(void* progress, double done) {
    (*static_cast<const std::function<void(double)>*>(progress))(done);
    return true;
}

std::string errorText(RTCDevice device, const char* what) {
    const RTCError code = rtcGetDeviceError(device);
    return std::string(what) + " (Embree error " + std::to_string(static_cast<int>(code)) + ")";
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

struct Tracer::Impl {
    RTCScene scene = nullptr;
    const CrtTriangle* triangles = nullptr;
    CrtContext context{};
    const CrtContext* slots = nullptr;  ///< As of Query.

    void use(const unsigned char* blob) {
        using kernel::u64;  // CRT_ARRAY computes with it
        const auto& header = *reinterpret_cast<const kernel::CrtScene*>(blob);
        triangles = CRT_ARRAY(CrtTriangle, blob, header.triangles);
        context.blob = blob;
        context.scene = &header;
        slots = header.shapes.count + header.instances.count > 0 ? &context : nullptr;
    }
};

Tracer::Tracer(const Device& device, const unsigned char* blob, const std::function<void(double)>& progress)
    : impl_(new Impl) {
    RTCDevice rtc = device.impl_->device;
    impl_->use(blob);
    impl_->scene = rtcNewScene(rtc);
    RTCGeometry geometry = rtcNewGeometry(rtc, RTC_GEOMETRY_TYPE_USER);
    rtcSetGeometryUserPrimitiveCount(geometry, impl_->context.scene->triangle_count);
    rtcSetGeometryUserData(geometry, const_cast<CrtTriangle*>(impl_->triangles));
    rtcSetGeometryBoundsFunction(geometry, slotBounds, nullptr);
    rtcSetGeometryIntersectFunction(geometry, closestHit);
    rtcSetGeometryOccludedFunction(geometry, anyHit);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(impl_->scene, geometry);
    rtcReleaseGeometry(geometry);
    rtcSetSceneProgressMonitorFunction(impl_->scene, reportProgress,
                                       const_cast<std::function<void(double)>*>(&progress));
    rtcCommitScene(impl_->scene);
    rtcSetSceneProgressMonitorFunction(impl_->scene, nullptr, nullptr);
    if (rtcGetDeviceError(rtc) != RTC_ERROR_NONE) {
        rtcReleaseScene(impl_->scene);
        throw plugin::PluginError(CRT_DEVICE_FAILED, errorText(rtc, "Embree could not build its scene"));
    }
}

Tracer::~Tracer() { rtcReleaseScene(impl_->scene); }

/// Embree asks for bounds while it builds, and never again.
void Tracer::moveTo(const unsigned char* blob) { impl_->use(blob); }

bool Tracer::takes(const CrtRay& ray) {
    using namespace kernel;
    const vec3 o = abs3(ray.o), d = abs3(ray.d);
    const bool near = o.x <= kReach && o.y <= kReach && o.z <= kReach;  // false for NaN
    return near && d.x <= kReach && d.y <= kReach && d.z <= kReach;
}

CrtHit Tracer::closest(const CrtRay& ray) const {
    Query query = makeQuery(impl_->triangles, impl_->slots, ray);
    RTCRayHit hit;
    hit.ray = embreeRay(ray);
    hit.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    hit.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
#if RTC_VERSION_MAJOR >= 4
    RTCIntersectArguments arguments;
    rtcInitIntersectArguments(&arguments);
    arguments.context = &query.context;
    rtcIntersect1(impl_->scene, &hit, &arguments);
#else
    rtcIntersect1(impl_->scene, &query.context, &hit);
#endif
    return query.best;
}

bool Tracer::any(const CrtRay& ray) const {
    Query query = makeQuery(impl_->triangles, impl_->slots, ray);
    RTCRay r = embreeRay(ray);
#if RTC_VERSION_MAJOR >= 4
    RTCOccludedArguments arguments;
    rtcInitOccludedArguments(&arguments);
    arguments.context = &query.context;
    rtcOccluded1(impl_->scene, &r, &arguments);
#else
    rtcOccluded1(impl_->scene, &query.context, &r);
#endif
    return r.tfar < 0.0f;  // Embree's mark for "occluded"
}

}  // namespace crt::embree
