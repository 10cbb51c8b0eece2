/// The properties of a PLY that crt supports, and the values of an element by their position.
#pragma once

#include "scene/mesh/ply_reader.h"
#include "scene/mesh/ply_rows.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace crt::ply {

/// The properties that crt supports: numbers of vertices, and lists of faces.
enum Role {
    kX,
    kY,
    kZ,
    kNx,
    kNy,
    kNz,
    kU,
    kV,
    kRed,
    kGreen,
    kBlue,
    kAlpha,
    kNumbers,
    kCorners,
    kWedges,
    kNone
};

/// The numbers and lists of an element.
struct Row {
    std::array<double, kNumbers> number{};
    std::vector<std::int64_t> corners;
    std::vector<double> wedges;
};

/// A property, and where it goes.
struct Slot {
    PlyProperty property;
    Role role = kNone;
};

template <class Cursor>
void readRow(Cursor& cursor, const std::vector<Slot>& slots, Row& row) {
    row.corners.clear();
    row.wedges.clear();
    for (const auto& [property, role] : slots) {
        if (!property.count) {
            const double number = cursor.number(property.type);
            if (role < kNumbers) row.number[role] = number;
            continue;
        }
        const std::uint64_t length = listLength(cursor, property);
        if (role == kCorners)
            for (std::uint64_t i = 0; i < length; ++i) row.corners.push_back(cursor.integer(property.type));
        else if (role == kWedges)
            for (std::uint64_t i = 0; i < length; ++i) row.wedges.push_back(cursor.number(property.type));
        else
            cursor.skip(length, property.type);
    }
}

bool has(const std::vector<Slot>& slots, Role role);
std::vector<Slot> slotsOfVertices(const PlyElement& element);
std::vector<Slot> slotsOfFaces(const PlyElement& element);

/// Numbers of a file → linear colours.
class ColorCode {
public:
    ColorCode() = default;
    ColorCode(PlyType type, PlyColor color);

    double full() const { return full_; }
    /// Of a number from 0 to full().
    float operator()(double number) const {
        return table_.empty() ? linear(number) : table_[static_cast<std::size_t>(number)];
    }

private:
    float linear(double number) const;

    double full_ = 1;
    bool encoded_ = false;
    std::vector<float> table_;
};

}  // namespace crt::ply
