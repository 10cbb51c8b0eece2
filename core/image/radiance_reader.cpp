// "Radiance File Formats" (Ward, radsite.lbl.gov/radiance/refer/filefmts.pdf), and Ward, "Real Pixels",
// Graphics Gems II (1991).
#include "image/radiance_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <stdexcept>
#include <string_view>
#include <system_error>
#include <vector>

namespace crt::image {
namespace {

/// The widest film; the newer run lengths end at 32767 as it is. Old runs of any length take a few bytes, so
/// that only this bounds what a row of them may become.
constexpr std::uint32_t kMostRadianceColumns = 65535;

/// One sentence about the file.
struct RadianceFault : std::runtime_error {
    using std::runtime_error::runtime_error;
};

/// A file, byte by byte.
class RadianceBytes {
public:
    explicit RadianceBytes(const char* path) : file_(std::fopen(path, "rbe")) {
        if (!file_) throw RadianceFault("it cannot be opened");
    }
    unsigned char byte() {
        if (next_ == end_) {
            next_ = 0;
            end_ = std::fread(buffer_.data(), 1, buffer_.size(), file_.get());
            if (end_ == 0) throw RadianceFault("it ends before its pixels do");
        }
        return buffer_[next_++];
    }
    /// Up to and without the end of the line.
    std::string line() {
        constexpr std::size_t kLongestLine = 4096;
        std::string text;
        for (unsigned char c = byte(); c != '\n'; c = byte()) {
            text += static_cast<char>(c);
            if (text.size() > kLongestLine) throw RadianceFault("a line of its header has no end");
        }
        if (!text.empty() && text.back() == '\r') text.pop_back();
        return text;
    }

private:
    struct CloseFile {
        void operator()(std::FILE* file) const { std::fclose(file); }
    };
    std::unique_ptr<std::FILE, CloseFile> file_;
    std::array<unsigned char, 65536> buffer_;
    std::size_t next_ = 0, end_ = 0;
};

std::string_view withoutSpaces(std::string_view text) {
    while (!text.empty() && (text.front() == ' ' || text.front() == '\t')) text.remove_prefix(1);
    while (!text.empty() && (text.back() == ' ' || text.back() == '\t')) text.remove_suffix(1);
    return text;
}

/// The next word, taken off the front.
std::string_view takeWord(std::string_view& text) {
    text = withoutSpaces(text);
    const std::string_view word = text.substr(0, text.find_first_of(" \t"));
    text.remove_prefix(word.size());
    return word;
}

/// The order of the pixels: along one axis within a row of the file, along the other from row to row.
struct Order {
    bool rows_are_columns = false;                 ///< X comes first: a row of the file is a column.
    bool from_bottom = false, from_right = false;  ///< +Y and -X.
};

std::uint32_t sizeIn(std::string_view word) {
    std::uint32_t size = 0;
    const auto [end, problem] = std::from_chars(word.data(), word.data() + word.size(), size);
    return problem == std::errc() && end == word.data() + word.size() ? size : 0;
}

/// "-Y 480 +X 640".
Order orderIn(const std::string& line, RadianceHeader& header) {
    std::string_view rest = line;
    const std::string_view first = takeWord(rest), first_size = takeWord(rest), second = takeWord(rest),
                           second_size = takeWord(rest);
    const auto is = [](std::string_view word, char axis) {
        return word.size() == 2 && (word[0] == '+' || word[0] == '-') && word[1] == axis;
    };
    Order order;
    order.rows_are_columns = is(first, 'X') && is(second, 'Y');
    const std::uint32_t rows = sizeIn(first_size), columns = sizeIn(second_size);
    if ((!order.rows_are_columns && !(is(first, 'Y') && is(second, 'X'))) || rows == 0 || columns == 0 ||
        !withoutSpaces(rest).empty())
        throw RadianceFault(
            fmt::format("'{}' is not a size such as -Y 480 +X 640", std::string_view(line).substr(0, 40)));
    if (columns > kMostRadianceColumns)
        throw RadianceFault(fmt::format("its rows of {} pixels are longer than can be read", columns));
    const std::string_view vertical = order.rows_are_columns ? second : first,
                           horizontal = order.rows_are_columns ? first : second;
    order.from_bottom = vertical[0] == '+';
    order.from_right = horizontal[0] == '-';
    header.width = order.rows_are_columns ? rows : columns;
    header.height = order.rows_are_columns ? columns : rows;
    return order;
}

/// As many numbers as `Count`, separated by blanks; nothing for other texts.
template <std::size_t Count>
std::optional<std::array<double, Count>> numbersIn(std::string_view value) {
    std::array<double, Count> numbers;
    for (double& number : numbers) {
        const std::string text(takeWord(value));
        char* end = nullptr;
        number = std::strtod(text.c_str(), &end);
        if (text.empty() || *end != '\0' || !std::isfinite(number)) return std::nullopt;
    }
    if (!withoutSpaces(value).empty()) return std::nullopt;
    return numbers;
}

[[noreturn]] void refuseLine(const char* key, std::string_view value, const char* expected) {
    throw RadianceFault(
        fmt::format("its {} is '{}', which is not {}", key, withoutSpaces(value).substr(0, 40), expected));
}

double exposureIn(std::string_view value) {
    const auto exposure = numbersIn<1>(value);
    if (!exposure || !((*exposure)[0] > 0)) refuseLine("EXPOSURE", value, "a positive number");
    return (*exposure)[0];
}

std::array<double, 3> correctionIn(std::string_view value) {
    const auto factors = numbersIn<3>(value);
    if (!factors || !std::all_of(factors->begin(), factors->end(), [](double f) { return f > 0; }))
        refuseLine("COLORCORR", value, "three positive numbers");
    return *factors;
}

/// Nothing for zeros, which Photoshop writes.
std::optional<std::array<float, 8>> primariesIn(std::string_view value) {
    constexpr double kMost = 1000;  // Primaries that no eye sees are beyond 1, too.
    const auto numbers = numbersIn<8>(value);
    const auto isUsable = [](double number) { return std::abs(number) <= kMost; };
    if (!numbers || !std::all_of(numbers->begin(), numbers->end(), isUsable))
        refuseLine("PRIMARIES", value, "eight numbers");
    std::array<float, 8> primaries;
    std::transform(numbers->begin(), numbers->end(), primaries.begin(),
                   [](double number) { return static_cast<float>(number); });
    if (primaries == std::array<float, 8>{}) return std::nullopt;
    return primaries;
}

Order takeRadianceHeader(RadianceBytes& bytes, RadianceHeader& header) {
    if (bytes.line().rfind("#?", 0) != 0) throw RadianceFault("it is not a Radiance HDR file");
    bool has_format = false, is_xyz = false;
    constexpr int kMostLines = 4096;
    for (int lines = 0;; ++lines) {
        if (lines > kMostLines) throw RadianceFault("its header has no end");
        const std::string line = bytes.line();
        if (line.empty()) break;
        const std::size_t equals = line.find('=');
        if (equals == std::string::npos) continue;  // A command that made it.
        const std::string_view key = withoutSpaces(std::string_view(line).substr(0, equals)),
                               value = withoutSpaces(std::string_view(line).substr(equals + 1));
        if (key == "FORMAT") {
            is_xyz = value == "32-bit_rle_xyze";
            if (!is_xyz && value != "32-bit_rle_rgbe")
                throw RadianceFault(
                    fmt::format("its FORMAT is '{}'; the formats of Radiance pictures are "
                                "32-bit_rle_rgbe and 32-bit_rle_xyze",
                                value.substr(0, 40)));
            has_format = true;
        } else if (key == "EXPOSURE") {
            header.exposure *= exposureIn(value);  // Each program that changes it adds a line.
        } else if (key == "COLORCORR") {
            const std::array<double, 3> factors = correctionIn(value);
            for (std::size_t k = 0; k < 3; ++k) header.color_correction[k] *= factors[k];
        } else if (key == "PRIMARIES") {
            header.chromaticities = primariesIn(value);
        }
    }
    if (!has_format)
        throw RadianceFault("its header has no line FORMAT=32-bit_rle_rgbe or FORMAT=32-bit_rle_xyze");
    if (is_xyz) header.chromaticities = {1, 0, 0, 1, 0, 0, 1.0f / 3, 1.0f / 3};
    return orderIn(bytes.line(), header);
}

/// Three mantissas and their exponent.
using Rgbe = std::array<unsigned char, 4>;

/// Each component on its own: after a head of 128 or more one byte, repeated; else as many bytes.
void takeRuns(RadianceBytes& bytes, std::vector<Rgbe>& row) {
    constexpr unsigned kRun = 128;
    for (std::size_t component = 0; component < 4; ++component)
        for (std::size_t x = 0; x < row.size();) {
            const unsigned head = bytes.byte();
            const bool repeats = head > kRun;
            const std::size_t count = repeats ? head - kRun : head;
            if (count == 0 || count > row.size() - x) throw RadianceFault("a run goes beyond its row");
            unsigned char value = 0;
            for (std::size_t i = 0; i < count; ++i) {
                if (i == 0 || !repeats) value = bytes.byte();
                row[x++][component] = value;
            }
        }
}

/// Pixels of four bytes. One with the mantissas 1, 1, 1 repeats the one before it; several in a row are the
/// digits, to the base 256, of how often.
void takePixelsAndOldRuns(RadianceBytes& bytes, const Rgbe& first, std::vector<Rgbe>& row) {
    unsigned shift = 0;
    for (std::size_t x = 0; x < row.size();) {
        Rgbe pixel = first;
        if (x > 0)
            for (unsigned char& component : pixel) component = bytes.byte();
        if (pixel[0] != 1 || pixel[1] != 1 || pixel[2] != 1) {
            row[x++] = pixel;
            shift = 0;
            continue;
        }
        const std::uint64_t count = std::uint64_t{pixel[3]} << shift;
        if (x == 0) throw RadianceFault("a row begins with a run, before any pixel");
        if (count > row.size() - x || shift > 24) throw RadianceFault("a run goes beyond its row");
        for (std::uint64_t i = 0; i < count; ++i, ++x) row[x] = row[x - 1];
        shift += 8;
    }
}

void takeRow(RadianceBytes& bytes, std::vector<Rgbe>& row) {
    constexpr std::size_t kFewestOfRuns = 8, kMostOfRuns = 32767;
    Rgbe first;
    for (unsigned char& component : first) component = bytes.byte();
    const bool in_runs = row.size() >= kFewestOfRuns && row.size() <= kMostOfRuns && first[0] == 2 &&
                         first[1] == 2 && first[2] < 128;
    if (!in_runs) return takePixelsAndOldRuns(bytes, first, row);
    if (first[2] * 256u + first[3] != row.size())
        throw RadianceFault("a row has a length that differs from its header");
    takeRuns(bytes, row);
}

/// As OpenImageIO and rgbe.c (Walter) do, not in the middle of the step as Radiance itself.
void decodePixel(const Rgbe& pixel, float* to) {
    constexpr int kBias = 128 + 8;
    const float unit = pixel[3] == 0 ? 0.0f : std::ldexp(1.0f, int{pixel[3]} - kBias);
    for (std::size_t k = 0; k < 3; ++k) to[k] = static_cast<float>(pixel[k]) * unit;
}

void takeRadiancePixels(RadianceBytes& bytes, const RadianceHeader& header, const Order& order,
                        float* pixels) {
    const std::uint32_t rows = order.rows_are_columns ? header.width : header.height,
                        columns = order.rows_are_columns ? header.height : header.width;
    std::vector<Rgbe> row(columns);
    for (std::uint32_t r = 0; r < rows; ++r) {
        takeRow(bytes, row);
        for (std::uint32_t c = 0; c < columns; ++c) {
            const std::uint32_t x = order.rows_are_columns ? r : c, y = order.rows_are_columns ? c : r;
            const std::uint64_t column = order.from_right ? header.width - 1 - x : x,
                                line = order.from_bottom ? header.height - 1 - y : y;
            decodePixel(row[c], pixels + 3 * (line * header.width + column));
        }
    }
}

/// The fewest bytes of a row: a pixel, and the digits of how often it is repeated.
std::uint64_t leastBytesOf(std::uint32_t columns) {
    std::uint64_t bytes = sizeof(Rgbe);
    for (std::uint32_t repeated = columns - 1; repeated > 0; repeated >>= 8) bytes += sizeof(Rgbe);
    return bytes;
}

void requireRows(const char* path, const RadianceHeader& header, const Order& order) {
    const std::uint64_t rows = order.rows_are_columns ? header.width : header.height;
    const std::uint32_t columns = order.rows_are_columns ? header.height : header.width;
    std::error_code unknown;
    if (rows * leastBytesOf(columns) > std::filesystem::file_size(path, unknown))
        throw RadianceFault(
            fmt::format("its header says {} x {} pixels, more than a file of its size can hold",
                        header.width, header.height));
}

}  // namespace

bool beginsAsRadiance(const char* path) {
    std::array<char, 2> mark{};
    std::FILE* const file = std::fopen(path, "rbe");
    if (file == nullptr) return false;
    const std::size_t there = std::fread(mark.data(), 1, mark.size(), file);
    std::fclose(file);
    return there == mark.size() && mark[0] == '#' && mark[1] == '?';
}

std::string readRadiance(const char* path, RadianceHeader* header, float* pixels, std::uint64_t count) {
    try {
        RadianceBytes bytes(path);
        *header = {};
        const Order order = takeRadianceHeader(bytes, *header);
        requireRows(path, *header, order);
        if (pixels == nullptr) return {};
        if (std::uint64_t{header->width} * header->height * 3 != count)
            return "it has changed while it was read";
        takeRadiancePixels(bytes, *header, order, pixels);
        return {};
    } catch (const RadianceFault& fault) {
        return fault.what();
    }
}

}  // namespace crt::image
