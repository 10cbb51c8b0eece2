#include "embree_scene.h"

#include "backend/plugin_guard.h"

#if defined(CRT_EMBREE_MAJOR) && CRT_EMBREE_MAJOR >= 4
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

#include <new>

namespace crt::embree {
namespace {

using kernel::CrtHit;
using kernel::CrtRay;
using kernel::CrtShear;
using kernel::CrtTriangle;

/// Embree's distances may differ from the shared test's in the last bits: what culls is given this much more reach.
constexpr float kReachSlack = 1.0f + 1e-5f;

#if RTC_VERSION_MAJOR >= 4
using QueryContext = RTCRayQueryContext;
void initContext(QueryContext* context) { rtcInitRayQueryContext(context); }
#else
using QueryContext = RTCIntersectContext;
void initContext(QueryContext* context) { rtcInitIntersectContext(context); }
#endif

/// What the filter callbacks need; Embree hands them the context back, which is its first member.
struct Query {
    QueryContext context;
    const CrtTriangle* triangles;
    CrtShear shear;
    CrtHit best;
    float reach;
};

Query& queryOf(const RTCFilterFunctionNArguments* arguments) { return *reinterpret_cast<Query*>(arguments->context); }

/// A candidate for the closest hit. Accepting shortens Embree's ray to just beyond the best shared hit, so that ties still come here.
void closestFilter(const RTCFilterFunctionNArguments* arguments) {
    Query& query = queryOf(arguments);
    const float before = query.best.t;
    crt_test_closest(query.triangles, RTCHitN_primID(arguments->hit, 1, 0), query.shear, &query.best);
    if (query.best.t < before)
        RTCRayN_tfar(arguments->ray, 1, 0) = query.best.t * kReachSlack;
    else
        arguments->valid[0] = 0;
}

void anyFilter(const RTCFilterFunctionNArguments* arguments) {
    Query& query = queryOf(arguments);
    CrtHit hit;
    if (!crt_intersect_triangle(query.triangles + RTCHitN_primID(arguments->hit, 1, 0), query.shear, query.reach, &hit)) arguments->valid[0] = 0;
}

Query makeQuery(const CrtTriangle* triangles, const CrtRay& ray) {
    Query query;
    initContext(&query.context);
    query.triangles = triangles;
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

/// How much larger, relative to its centre, a triangle is shown to Embree, so that its edges move out by some 2e-6 of the scene: what the shared test
/// accepts at an edge is then inside for Embree, whose own edge test rounds otherwise and now and then hides a hit from both sides.
float growthOf(const CrtTriangle& triangle) {
    using namespace kernel;
    const vec3 a = crt_triangle_vertex(&triangle, 0);
    const vec3 ab = crt_triangle_vertex(&triangle, 1) - a, ac = crt_triangle_vertex(&triangle, 2) - a;
    const float twice_area = length3(cross3(ab, ac));
    const float longest = crt_max(length3(ab), crt_max(length3(ac), length3(ac - ab)));
    // The least height is twice_area / longest, and the centre lies a third of it from the edge.
    const float growth = 3 * 2e-6f * longest;
    return growth < twice_area ? growth / twice_area : 1.0f;
}

std::string errorText(RTCDevice device, const char* what) {
    const RTCError code = rtcGetDeviceError(device);
    return std::string(what) + " (Embree error " + std::to_string(static_cast<int>(code)) + ")";
}

}  // namespace

struct Device::Impl {
    RTCDevice device = nullptr;
};

Device::Device(unsigned threads) : impl_(new Impl) {
    const std::string config = "threads=" + std::to_string(threads);
    impl_->device = rtcNewDevice(config.c_str());
    if (impl_->device == nullptr) throw plugin::PluginError(CRT_NO_DEVICE, errorText(nullptr, "Embree could not be started"));
}

Device::~Device() { rtcReleaseDevice(impl_->device); }

std::string Device::version() {
    return std::to_string(RTC_VERSION_MAJOR) + "." + std::to_string(RTC_VERSION_MINOR) + "." + std::to_string(RTC_VERSION_PATCH);
}

struct Tracer::Impl {
    RTCScene scene = nullptr;
    const CrtTriangle* triangles = nullptr;
};

Tracer::Tracer(const Device& device, const CrtTriangle* triangles, std::uint32_t count) : impl_(new Impl) {
    RTCDevice rtc = device.impl_->device;
    impl_->triangles = triangles;
    impl_->scene = rtcNewScene(rtc);
    // Robust: candidates at edges and vertices must reach the shared test whichever side Embree's own rounding puts them on.
    rtcSetSceneFlags(impl_->scene, RTC_SCENE_FLAG_ROBUST);
    rtcSetSceneBuildQuality(impl_->scene, RTC_BUILD_QUALITY_HIGH);
    RTCGeometry geometry = rtcNewGeometry(rtc, RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* vertices = static_cast<float*>(
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), 3ull * count));
    auto* indices = static_cast<std::uint32_t*>(
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(std::uint32_t), count));
    if (vertices == nullptr || indices == nullptr) {
        rtcReleaseGeometry(geometry);
        rtcReleaseScene(impl_->scene);
        throw std::bad_alloc();
    }
    for (std::uint32_t t = 0; t < count; ++t) {
        const float growth = growthOf(triangles[t]);
        for (std::uint32_t axis = 0; axis < 3; ++axis) {
            const float* p = triangles[t].p + 3 * axis;
            const float centre = (p[0] + p[1] + p[2]) / 3;
            for (std::uint32_t v = 0; v < 3; ++v) vertices[9ull * t + 3 * v + axis] = p[v] + (p[v] - centre) * growth;
        }
        for (std::uint32_t v = 0; v < 3; ++v) indices[3ull * t + v] = 3 * t + v;
    }
    rtcSetGeometryIntersectFilterFunction(geometry, closestFilter);
    rtcSetGeometryOccludedFilterFunction(geometry, anyFilter);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(impl_->scene, geometry);
    rtcReleaseGeometry(geometry);
    rtcCommitScene(impl_->scene);
    if (rtcGetDeviceError(rtc) != RTC_ERROR_NONE) {
        rtcReleaseScene(impl_->scene);
        throw plugin::PluginError(CRT_DEVICE_FAILED, errorText(rtc, "Embree could not build its scene"));
    }
}

Tracer::~Tracer() { rtcReleaseScene(impl_->scene); }

CrtHit Tracer::closest(const CrtRay& ray) const {
    Query query = makeQuery(impl_->triangles, ray);
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
    Query query = makeQuery(impl_->triangles, ray);
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
