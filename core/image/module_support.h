/// Code that both image modules have (image_module.h): failures become sentences, and an image owns the
/// arrays that its C view points to.
#pragma once

#include "image/image_module.h"

#include <array>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <fstream>
#include <new>
#include <stdexcept>
#include <string>
#include <vector>

namespace crt::image {

/// One sentence, to follow the name of the file.
struct Failure : std::runtime_error {
    using std::runtime_error::runtime_error;
};

/// Throws Failure with a reader's message, unless it is empty.
inline void require(const std::string& why) {
    if (!why.empty()) throw Failure{why};
}

/// Runs `body`; no exception crosses the border. The result is that of the module's functions.
template <class Body>
std::int32_t guarded(char* reason, std::uint32_t reason_size, Body&& body) noexcept {
    const auto say = [&](const char* text) {
        if (reason != nullptr && reason_size > 0) std::snprintf(reason, reason_size, "%s", text);
        return 1;
    };
    try {
        body();
        return 0;
    } catch (const std::bad_alloc&) {
        return say("there is not enough memory for its pixels");
    } catch (const std::exception& exception) {
        return say(exception.what());
    } catch (...) {
        return say("the image library failed in an unknown way");
    }
}

/// The channels of a texture to read.
enum class TexelPart { Color, Alpha };

/// The caller's buffer.
struct Target {
    unsigned char* data;  ///< Null to read only the header.
    std::uint64_t bytes;
};

/// The image that read() returns, with the data that it points to.
struct OwnedImage : CrtImagePlanes {
    OwnedImage() : CrtImagePlanes{} {}
    std::vector<std::string> float_names, integer_names;
    std::vector<std::string> metadata_text;  ///< Name, value, name, …
    std::vector<float> float_values;
    std::vector<std::uint32_t> integer_values;
    std::array<float, 8> primaries{};

    /// Points the C view at the vectors, which stay as they are from now on.
    void show() {
        for (std::size_t i = 0; i + 1 < metadata_text.size(); i += 2)
            texts_.push_back({metadata_text[i].c_str(), metadata_text[i + 1].c_str()});
        for (const std::string& name : float_names) float_pointers_.push_back(name.c_str());
        for (const std::string& name : integer_names) integer_pointers_.push_back(name.c_str());
        float_channel_count = static_cast<std::uint32_t>(float_names.size());
        integer_channel_count = static_cast<std::uint32_t>(integer_names.size());
        float_channels = float_pointers_.data();
        integer_channels = integer_pointers_.data();
        floats = float_values.data();
        integers = integer_values.data();
        metadata = texts_.data();
        metadata_count = static_cast<std::uint32_t>(texts_.size());
    }

private:
    std::vector<const char*> float_pointers_, integer_pointers_;
    std::vector<CrtImageText> texts_;
};

/// The functions read_texels and read_alpha of a module, of its own `read`.
template <TexelPart part, void (*read)(TexelPart, const char*, CrtTexelsInfo&, const Target&)>
std::int32_t readPartBy(const char* path, CrtTexelsInfo* info, void* buffer, std::uint64_t buffer_bytes,
                        char* reason, std::uint32_t reason_size) {
    return guarded(reason, reason_size, [&] {
        *info = {};
        read(part, path, *info, {static_cast<unsigned char*>(buffer), buffer_bytes});
    });
}

inline void freeImage(const CrtImagePlanes* image) { delete static_cast<const OwnedImage*>(image); }

}  // namespace crt::image
