/// Images in memory and in files.
#pragma once

#include <crt/export.h>
#include <crt/watch.h>

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

CRT_API_NAMESPACE_BEGIN

/// Named planes of floats and of integers, with what image files keep beside them: primaries, the window,
/// metadata.
class CRT_API Image {
public:
    /// PFM, PPM, EXR, PNG or Radiance HDR, by content; values are linear. Throws crt::Error of kind Usage.
    static Image load(const std::string& path);
    /// By the extension: .exr keeps everything, .pfm the floats of R, G and B, .png, .jpg and .ppm 8 bits of
    /// sRGB. Written under another name and renamed. Throws crt::Error of kind Output; Usage for another
    /// extension.
    void save(const std::string& path, Watch* watch = nullptr) const;

    Image(const Image&);
    Image(Image&&) noexcept;
    Image& operator=(const Image&);
    Image& operator=(Image&&) noexcept;
    ~Image();

    std::uint32_t width() const;
    std::uint32_t height() const;
    /// "R", "G", "B", "Albedo.R", …
    const std::vector<std::string>& channels() const;
    /// [height][width][channels], top row first.
    const std::vector<float>& pixels() const;
    /// [height][width] of one channel. Throws crt::Error of kind Usage where there is none of that name.
    std::vector<float> plane(const std::string& channel) const;
    /// Planes that count or number, such as "sampleCount" and "id.primitive".
    const std::vector<std::string>& integerChannels() const;
    /// [height][width][integerChannels], top row first.
    const std::vector<std::uint32_t>& integers() const;

    struct Impl;
    /// For libcrt itself.
    explicit Image(std::unique_ptr<Impl> impl);

private:
    std::unique_ptr<Impl> impl_;
};

CRT_API_NAMESPACE_END
