#include "scene/mesh/ply_rows.h"

namespace crt {
namespace {

void skipRow(BinaryPlyCursor& cursor, const PlyElement& element) {
    for (const PlyProperty& p : element.properties) {
        if (p.count)
            cursor.skip(listLength(cursor, p), p.type);
        else
            cursor.skip(1, p.type);
    }
}

bool isSwapped(PlyFormat format) {
    constexpr bool little = std::endian::native == std::endian::little;
    return format == (little ? PlyFormat::BigEndian : PlyFormat::LittleEndian);
}

}  // namespace

PlyRows::PlyRows(const std::string& content, const PlyHeader& header, const std::string& path,
                 std::size_t rows_at_a_time)
    : content_(content),
      header_(header),
      path_(path),
      ascii_(header.format == PlyFormat::Ascii),
      swapped_(isSwapped(header.format)) {
    PlyBlocks::Place place{header.bytes, header.lines};
    for (const PlyElement& element : header.elements) {
        requirePlausible(element, place.at);
        locate(element, place, rows_at_a_time);
    }
    const std::string_view rest = std::string_view(content).substr(place.at);
    const bool blank = ascii_ && rest.find_first_not_of(" \t\r\n") == std::string_view::npos;
    trailing_ = blank ? 0 : rest.size();
}

const PlyBlocks& PlyRows::blocksOf(const PlyElement& element) const {
    return *std::find_if(blocks_.begin(), blocks_.end(),
                         [&](const PlyBlocks& b) { return b.element == &element; });
}

/// A short file may claim any number of elements.
void PlyRows::requirePlausible(const PlyElement& element, std::size_t at) const {
    const std::uint64_t left = content_.size() - at;
    // In text a digit and what ends it, but for the last.
    const std::uint64_t least = ascii_ ? 2 * element.properties.size() : element.leastBytes();
    if (least == 0 || element.count <= (left + (ascii_ ? 1 : 0)) / least) return;
    throw Error(ErrorKind::Scene,
                fmt::format("the header says {} of {}, {} bytes each or more, and {} bytes follow",
                            element.count, inQuotes(element.name), least, left),
                {path_, element.line});
}

/// Moves `place` behind the elements of one kind.
void PlyRows::locate(const PlyElement& element, PlyBlocks::Place& place, std::size_t rows_at_a_time) {
    PlyBlocks& blocks = blocks_.emplace_back(PlyBlocks{&element, rows_at_a_time, {}});
    if (element.properties.empty()) return;
    BinaryPlyCursor binary(content_, place.at, swapped_);
    const std::size_t begin = place.at, size = binary.left(), row_bytes = element.leastBytes();
    const bool fixed = !ascii_ && !element.hasLists();
    for (std::uint64_t i = 0; i < element.count; ++i) {
        if (i % rows_at_a_time == 0) blocks.places.push_back(place);
        try {
            if (ascii_)
                (void)nextLine(place);
            else if (fixed)
                place.at += row_bytes;
            else
                skipRow(binary, element), place.at = begin + (size - binary.left());
        } catch (const BadPlyRow& row) {
            fail(element, i, row, place.line);
        }
    }
}

/// Skips blank ones.
std::string_view PlyRows::nextLine(PlyBlocks::Place& place) const {
    while (place.at < content_.size()) {
        const std::size_t end = std::min(content_.find(header_.line_end, place.at), content_.size());
        const std::string_view line = trimmed(std::string_view(content_).substr(place.at, end - place.at));
        place.at = std::min(end + 1, content_.size());
        ++place.line;
        if (!line.empty()) return line;
    }
    throw BadPlyRow{"is missing: the file ends before it"};
}

void PlyRows::fail(const PlyElement& element, std::uint64_t number, const BadPlyRow& row, int line) const {
    throw Error(
        ErrorKind::Scene,
        fmt::format("{} {} of {}, counted from 0, {}", element.name, number, element.count, row.what),
        {path_, line});
}

}  // namespace crt
