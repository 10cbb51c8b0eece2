/// Bodies whose surfaces coincide: which of two a ray meets is rounding, so its list of media
/// (kernel/medium.h) cannot rely on either.
#pragma once

namespace crt {

/// Sets CRT_PRIMITIVE_TOUCHES of the triangles of a finished blob that bound a medium and lie, at least in
/// part, in the plane of another such triangle of another object. Triangles of instances and shapes are not
/// asked. Nothing to do, and no time, where fewer than two objects bound media.
void markTouchingMedia(unsigned char* blob);

}  // namespace crt
