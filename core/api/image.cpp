#include "api/border.h"
#include "image/image_io.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace crt::v0 {

Image Image::load(const std::string& path) {
    return api::acrossBorder(nullptr, [&] { return Image(std::make_unique<Impl>(Impl{readImage(path)})); });
}

void Image::save(const std::string& path, Watch* watch) const {
    api::acrossBorder(watch, [&] {
        const std::optional<OutputFormat> format = formatOfFile(path);
        if (!format)
            throw crt::Error(crt::ErrorKind::Usage,
                             fmt::format("the name of the image '{}' does not end in {}", path, kImageEnds));
        checkWritable(path);
        writeImage(path, *format, impl_->image);
    });
}

Image::Image(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Image::Image(const Image& other) : impl_(std::make_unique<Impl>(*other.impl_)) {}
Image::Image(Image&&) noexcept = default;
Image& Image::operator=(const Image& other) {
    impl_ = std::make_unique<Impl>(*other.impl_);
    return *this;
}
Image& Image::operator=(Image&&) noexcept = default;
Image::~Image() = default;

std::uint32_t Image::width() const { return impl_->image.width; }
std::uint32_t Image::height() const { return impl_->image.height; }
const std::vector<std::string>& Image::channels() const { return impl_->image.channels; }
const std::vector<float>& Image::pixels() const { return impl_->image.pixels; }
const std::vector<std::string>& Image::integerChannels() const { return impl_->image.integer_channels; }
const std::vector<std::uint32_t>& Image::integers() const { return impl_->image.integers; }

std::vector<float> Image::plane(const std::string& channel) const {
    const std::vector<std::string>& names = channels();
    const auto found = std::find(names.begin(), names.end(), channel);
    if (found == names.end())
        throw Error(ErrorKind::Usage,
                    fmt::format("the image has no channel '{}', but {}", channel, fmt::join(names, ", ")));
    std::vector<float> values;
    values.reserve(std::size_t{width()} * height());
    for (std::size_t i = static_cast<std::size_t>(found - names.begin()); i < pixels().size();
         i += names.size())
        values.push_back(pixels()[i]);
    return values;
}

}  // namespace crt::v0
