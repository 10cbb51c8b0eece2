/// The elements of a PLY behind its header: where each lies, and its values one after the other.
#pragma once

#include "base/error.h"
#include "scene/mesh/obj_text.h"
#include "scene/mesh/ply_header.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace crt {

/// The error of an element, to follow "face 17".
struct BadPlyRow {
    std::string what;
};

/// Values of a binary file. Throws BadPlyRow where it ends.
class BinaryPlyCursor {
public:
    BinaryPlyCursor(std::string_view content, std::size_t at, bool swapped)
        : at_(content.data() + at), end_(content.data() + content.size()), swapped_(swapped) {}

    double number(PlyType type) {
        switch (type) {
            case PlyType::Float32: return take<float>();
            case PlyType::Float64: return take<double>();
            default: return static_cast<double>(integer(type));
        }
    }
    /// Of an integer type.
    std::int64_t integer(PlyType type) {
        switch (type) {
            case PlyType::Int8: return take<std::int8_t>();
            case PlyType::Uint8: return take<std::uint8_t>();
            case PlyType::Int16: return take<std::int16_t>();
            case PlyType::Uint16: return take<std::uint16_t>();
            case PlyType::Int32: return take<std::int32_t>();
            default: return take<std::uint32_t>();
        }
    }
    void requireValues(std::uint64_t count, PlyType type) const {
        if (count > left() / bytesOf(type))
            throw BadPlyRow{fmt::format("has a list of {} values, and {} bytes follow", count, left())};
    }
    /// As many as requireValues() allows.
    void skip(std::uint64_t count, PlyType type) { at_ += requireBytes(count * bytesOf(type)); }
    std::size_t left() const { return static_cast<std::size_t>(end_ - at_); }

private:
    std::size_t requireBytes(std::size_t bytes) const {
        if (left() < bytes) throw BadPlyRow{"is cut off: the file ends there"};
        return bytes;
    }
    template <class T>
    T take() {
        std::array<char, sizeof(T)> bytes;
        std::memcpy(bytes.data(), at_, requireBytes(sizeof(T)));
        at_ += sizeof(T);
        if (swapped_) std::reverse(bytes.begin(), bytes.end());
        return std::bit_cast<T>(bytes);
    }

    const char *at_, *end_;
    bool swapped_;
};

/// Values of a line of text. Throws BadPlyRow where it has too few, or no whole number where one belongs. A
/// number that cannot be read is NaN.
class AsciiPlyCursor {
public:
    explicit AsciiPlyCursor(std::string_view line) : rest_(line) {}

    double number(PlyType) {
        const std::string_view text = field();
        return numberOf(text).value_or(std::numeric_limits<double>::quiet_NaN());
    }
    std::int64_t integer(PlyType) {
        const std::string_view text = field();
        std::int64_t value = 0;
        const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
        if (error == std::errc() && end == text.data() + text.size()) return value;
        // Some programs write all numbers as floats.
        constexpr double kExact = 9e15;
        const double real = numberOf(text).value_or(0.5);
        if (!(std::abs(real) < kExact) || real != std::floor(real))
            throw BadPlyRow{fmt::format("has {} where a whole number is expected", inQuotes(text))};
        return static_cast<std::int64_t>(real);
    }
    void requireValues(std::uint64_t count, PlyType) const {
        if (count > rest_.size())
            throw BadPlyRow{fmt::format("has a list of {} values, and fewer on its line", count)};
    }
    void skip(std::uint64_t count, PlyType) {
        for (std::uint64_t i = 0; i < count; ++i) (void)field();
    }

private:
    std::string_view field() {
        const std::string_view field = nextField(rest_);
        if (field.empty()) throw BadPlyRow{"has too few values on its line"};
        return field;
    }

    std::string_view rest_;
};

/// The length of a list.
template <class Cursor>
std::uint64_t listLength(Cursor& cursor, const PlyProperty& list) {
    const std::int64_t length = cursor.integer(*list.count);
    if (length < 0) throw BadPlyRow{fmt::format("has a list of {} values", length)};
    cursor.requireValues(static_cast<std::uint64_t>(length), list.type);
    return static_cast<std::uint64_t>(length);
}

/// Places of the elements of one kind: the first of every `rows_at_a_time`.
struct PlyBlocks {
    const PlyElement* element = nullptr;
    std::size_t rows_at_a_time = 1;
    struct Place {
        std::size_t at;
        int line;
    };
    std::vector<Place> places;

    std::size_t first(std::size_t block) const { return block * rows_at_a_time; }
    std::size_t end(std::size_t block) const {
        return std::min<std::size_t>(first(block) + rows_at_a_time, element->count);
    }
};

/// The content of a PLY, and where its elements lie in it.
class PlyRows {
public:
    /// Goes through the whole content: what `blocksOf` returns can be read. Throws crt::Error(Scene) for
    /// content that does not hold what the header says, before anything of that size is allocated.
    PlyRows(const std::string& content, const PlyHeader& header, const std::string& path,
            std::size_t rows_at_a_time);

    const PlyBlocks& blocksOf(const PlyElement& element) const;
    /// Bytes behind the last element that are not blank.
    std::size_t trailingBytes() const { return trailing_; }

    /// Calls visit(cursor, number, line) for each element of a block; lines are 0 in binary files. A
    /// BadPlyRow of it becomes a crt::Error(Scene) with the place.
    template <class Visit>
    void forEachRow(const PlyBlocks& blocks, std::size_t block, const Visit& visit) const {
        PlyBlocks::Place place = blocks.places[block];
        BinaryPlyCursor binary(content_, place.at, swapped_);
        for (std::size_t i = blocks.first(block); i < blocks.end(block); ++i) {
            try {
                if (ascii_) {
                    AsciiPlyCursor line(nextLine(place));
                    visit(line, i, place.line);
                } else {
                    visit(binary, i, 0);
                }
            } catch (const BadPlyRow& row) {
                fail(*blocks.element, i, row, place.line);
            }
        }
    }

private:
    void locate(const PlyElement& element, PlyBlocks::Place& place, std::size_t rows_at_a_time);
    void requirePlausible(const PlyElement& element, std::size_t at) const;
    std::string_view nextLine(PlyBlocks::Place& place) const;
    [[noreturn]] void fail(const PlyElement& element, std::uint64_t number, const BadPlyRow& row,
                           int line) const;

    const std::string& content_;
    const PlyHeader& header_;
    const std::string& path_;
    bool ascii_, swapped_;
    std::vector<PlyBlocks> blocks_;  ///< By the header's elements.
    std::size_t trailing_ = 0;
};

}  // namespace crt
