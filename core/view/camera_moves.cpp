#include "view/camera_moves.h"

#include "base/vec3d.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace crt {
namespace {

Vec3d unit(const Vec3d& v) { return v * (1 / length(v)); }

/// Rodrigues: `v` around the unit `axis`, counter-clockwise seen from its tip.
Vec3d rotated(const Vec3d& v, const Vec3d& axis, double angle) {
    const double c = std::cos(angle), s = std::sin(angle);
    return v * c + cross(axis, v) * s + axis * (dot(axis, v) * (1 - c));
}

double shorterSide(const Camera& camera) { return std::min(camera.tan_half_width, camera.tan_half_height); }

double tanOfHalf(double degrees) { return std::tan(degrees * (std::numbers::pi / 360)); }

void setTanHalfFov(CameraPose& pose, const Camera& camera, double wanted) {
    const double own = shorterSide(camera);
    pose.tan_half_fov = std::clamp(wanted, std::min(own, tanOfHalf(kLeastFov_deg)),
                                   std::max(own, tanOfHalf(kMostFov_deg)));
}

}  // namespace

CameraPose poseOf(const Camera& camera) {
    return {camera.position, camera.target, camera.up, camera.focus_distance, shorterSide(camera)};
}

Camera withPose(Camera camera, const CameraPose& pose) {
    camera.position = pose.position;
    camera.target = pose.target;
    camera.up = pose.up;
    camera.focus_distance = pose.focus_distance;
    // Exactly 1 where the angle is the camera's own.
    const double wider = pose.tan_half_fov / shorterSide(camera);
    camera.tan_half_width *= wider;
    camera.tan_half_height *= wider;
    return camera;
}

void orbit(CameraPose& pose, double to_right, double upwards) {
    constexpr double kNearestToPole = std::numbers::pi / 180;
    const Vec3d axis = unit(pose.up);
    Vec3d offset = pose.position - pose.target;
    const double from_pole = std::acos(std::clamp(dot(unit(offset), axis), -1.0, 1.0));
    // A scene's own camera may be nearer to a pole; it is not moved farther that way.
    const double least = std::min(kNearestToPole, from_pole);
    const double most = std::max(std::numbers::pi - kNearestToPole, from_pole);
    const double wanted = std::clamp(from_pole - upwards, least, most);
    const Vec3d right = unit(cross(axis, offset));
    offset = rotated(offset, right, wanted - from_pole);
    offset = rotated(offset, axis, to_right);
    pose.position = pose.target + offset;
}

void pan(CameraPose& pose, const Camera& camera, double to_right, double upwards) {
    const Vec3d view = pose.target - pose.position;
    const Vec3d right = unit(cross(view, pose.up));
    const Vec3d up = unit(cross(right, view));
    const double distance = length(view);
    const Vec3d shift = right * (-to_right * 2 * camera.tan_half_width * distance) +
                        up * (-upwards * 2 * camera.tan_half_height * distance);
    pose.position = pose.position + shift;
    pose.target = pose.target + shift;
}

void dolly(CameraPose& pose, double factor) {
    pose.position = pose.target + (pose.position - pose.target) * factor;
}

double fovOf_deg(const CameraPose& pose) { return std::atan(pose.tan_half_fov) * (360 / std::numbers::pi); }

void setFov(CameraPose& pose, const Camera& camera, double fov_deg) {
    setTanHalfFov(pose, camera, tanOfHalf(fov_deg));
}

void zoom(CameraPose& pose, const Camera& camera, double factor) {
    setTanHalfFov(pose, camera, pose.tan_half_fov / factor);
}

double depthOfRay(const Camera& camera, double x, double y, double distance) {
    const double across = (2 * x - 1) * camera.tan_half_width, along = (2 * y - 1) * camera.tan_half_height;
    return distance / std::sqrt(1 + across * across + along * along);
}

}  // namespace crt
