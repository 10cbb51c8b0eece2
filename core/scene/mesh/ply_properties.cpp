#include "scene/mesh/ply_properties.h"

#include "spectra/spectra.h"

#include <algorithm>
#include <initializer_list>
#include <string>
#include <string_view>

namespace crt::ply {
namespace {

std::vector<Slot> slotsOf(const PlyElement& element) {
    std::vector<Slot> slots;
    for (const PlyProperty& p : element.properties) slots.push_back({p});
    return slots;
}

/// Gives the properties of these names their roles, if all of them are there.
bool assign(std::vector<Slot>& slots, std::initializer_list<std::string_view> names, int first_role) {
    std::vector<Slot*> found;
    for (const std::string_view name : names) {
        const auto slot = std::find_if(slots.begin(), slots.end(), [&](const Slot& s) {
            return !s.property.count && s.property.name == name;
        });
        if (slot == slots.end()) return false;
        found.push_back(&*slot);
    }
    for (Slot* slot : found) slot->role = static_cast<Role>(first_role++);
    return true;
}

}  // namespace

bool has(const std::vector<Slot>& slots, Role role) {
    return std::any_of(slots.begin(), slots.end(), [&](const Slot& s) { return s.role == role; });
}

std::vector<Slot> slotsOfVertices(const PlyElement& element) {
    std::vector<Slot> slots = slotsOf(element);
    assign(slots, {"x", "y", "z"}, kX);
    assign(slots, {"nx", "ny", "nz"}, kNx);
    (void)(assign(slots, {"u", "v"}, kU) || assign(slots, {"s", "t"}, kU) ||
           assign(slots, {"texture_u", "texture_v"}, kU) || assign(slots, {"texture_s", "texture_t"}, kU));
    (void)(assign(slots, {"red", "green", "blue"}, kRed) || assign(slots, {"r", "g", "b"}, kRed) ||
           assign(slots, {"diffuse_red", "diffuse_green", "diffuse_blue"}, kRed));
    assign(slots, {"alpha"}, kAlpha);
    return slots;
}

std::vector<Slot> slotsOfFaces(const PlyElement& element) {
    std::vector<Slot> slots = slotsOf(element);
    for (Slot& s : slots) {
        if (!s.property.count) continue;
        const std::string& name = s.property.name;
        if ((name == "vertex_indices" || name == "vertex_index") && !has(slots, kCorners))
            s.role = kCorners;
        else if (name == "texcoord")
            s.role = kWedges;
    }
    return slots;
}

ColorCode::ColorCode(PlyType type, PlyColor color) {
    switch (type) {
        case PlyType::Int8: full_ = 127; break;
        case PlyType::Uint8: full_ = 255; break;
        case PlyType::Int16: full_ = 32767; break;
        case PlyType::Uint16: full_ = 65535; break;
        case PlyType::Int32: full_ = 2147483647; break;
        case PlyType::Uint32: full_ = 4294967295; break;
        case PlyType::Float32:
        case PlyType::Float64: break;
    }
    encoded_ = color == PlyColor::Srgb || (color == PlyColor::ByType && isInteger(type));
    if (type == PlyType::Uint8)
        for (int i = 0; i < 256; ++i) table_.push_back(linear(i));
}

float ColorCode::linear(double number) const {
    const double share = number / full_;
    return static_cast<float>(encoded_ ? srgbToLinear(share) : share);
}

}  // namespace crt::ply
