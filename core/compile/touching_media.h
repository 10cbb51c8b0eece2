/// Bodies whose surfaces coincide. Rounding decides which of two coinciding surfaces a ray meets, so a path
/// must not rely on having met both (kernel/materials/medium.h).
#pragma once

namespace crt {

/// Sets CRT_PRIMITIVE_TOUCHES in a finished blob for triangles that bound a medium and overlap, in one
/// plane, such a triangle of another object. Does not look at instances and shapes. Returns at once if
/// fewer than two objects bound media.
void markTouchingMedia(unsigned char* blob);

}  // namespace crt
