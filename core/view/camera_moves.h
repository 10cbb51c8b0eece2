/// Moves a camera by gestures: around the target, along the image, towards the target.
#pragma once

#include "scene/scene.h"

namespace crt {

/// The part of a camera that hands move.
struct CameraPose {
    Vec3d position{}, target{}, up{};
    double focus_distance = 0;  ///< As of Camera.
    double tan_half_fov = 0.5;  ///< Of the angle across the shorter side of the image.
    bool operator==(const CameraPose&) const = default;
};

CameraPose poseOf(const Camera& camera);
/// The camera with this pose.
Camera withPose(Camera camera, const CameraPose& pose);

/// Around the target and the axis `up`: to the right as the image shows it, and upwards. Radians. The camera
/// stays a degree away from the poles, where right and left would change sides.
void orbit(CameraPose& pose, double to_right, double upwards);

/// Camera and target together, so that what lies at the target's distance moves across the image: to the
/// right in widths of the image, upwards in heights.
void pan(CameraPose& pose, const Camera& camera, double to_right, double upwards);

/// Multiplies the distance to the target by `factor`, which is above 0.
void dolly(CameraPose& pose, double factor);

inline constexpr double kLeastFov_deg = 0.01, kMostFov_deg = 175;
/// Full angle across the shorter side of the image, degrees.
double fovOf_deg(const CameraPose& pose);
/// Sets that angle. It stays within kLeastFov_deg and kMostFov_deg; the angle of `camera`, the scene's own,
/// can lie beyond them.
void setFov(CameraPose& pose, const Camera& camera, double fov_deg);
/// Makes the image `factor` times as large, which is above 0, within the same limits.
void zoom(CameraPose& pose, const Camera& camera, double factor);
/// Distance along the view axis of what lies at `distance` along the ray through (x, y) of the image: (0, 0)
/// is its upper left corner, (1, 1) the lower right.
double depthOfRay(const Camera& camera, double x, double y, double distance);

}  // namespace crt
