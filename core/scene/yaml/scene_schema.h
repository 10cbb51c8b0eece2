/// The one table of every key a scene file may have. The reader's checks, the did-you-mean, docs/scene.md
/// and the JSON Schema are all made from it, so none of them can know a key that the others do not.
#pragma once

#include <limits>
#include <string>
#include <string_view>
#include <vector>

namespace crt {

enum class ValueKind {
    Integer,
    Number,
    Boolean,
    Text,
    Choice,    ///< One of KeySchema::choices.
    Spectrum,  ///< Number, name of a spectrum, or a map of one of the "spectrum/…" sections.
    Section,   ///< A map described by `section`.
};

/// Number of values of the kind, and their arrangement.
enum class ValueShape {
    One,
    List,       ///< `count_min` to `count_max` values.
    OneOrList,  ///< Either.
    Lists,      ///< A list of lists of `count_min` to `count_max` values.
    Map,        ///< Free names → values.
};

/// Range of a number; the bounds belong to it unless open.
struct ValueRange {
    double min = -std::numeric_limits<double>::infinity();
    double max = std::numeric_limits<double>::infinity();
    bool min_open = false;
    bool max_open = false;

    bool contains(double value) const {
        return (min_open ? value > min : value >= min) && (max_open ? value < max : value <= max);
    }
    /// "0 to 1", "above 0", "any".
    std::string text() const;
};

inline constexpr int kUnbounded = std::numeric_limits<int>::max();

/// One row of the table.
struct KeySchema {
    std::string name{};
    ValueKind kind = ValueKind::Text;
    ValueShape shape = ValueShape::One;
    int count_min = 0;
    int count_max = kUnbounded;
    ValueRange range{};
    std::string unit{};
    std::vector<std::string>
        choices{};  ///< In the order of the C++ enumeration they stand for, if there is one.
    std::string section{};               ///< Name of the section, or the part before '/' of its variants.
                                         ///< Of other kinds: a map of it will do instead.
    std::string fallback{};              ///< The default, as YAML; empty when there is none.
    bool required = false;
    bool nullable = false;               ///< `null` says "none".
    std::string doc{};
};

/// Relation between several keys of one map.
struct KeyRule {
    enum class Kind { ExactlyOne, AtMostOne, Together } kind;
    std::vector<std::string> keys;
};

/// The keys of one kind of map.
struct SectionSchema {
    std::string name;   ///< "film", or "material/diffuse" for a variant.
    std::string title;  ///< "film", "a diffuse material": as messages say it.
    std::string doc;
    std::vector<KeySchema> keys;
    std::vector<KeyRule> rules{};

    const KeySchema* find(std::string_view key) const;
    std::vector<std::string> keyNames() const;
};

/// All sections in the order of the reference manual. The first, with the empty name, is the top level.
const std::vector<SectionSchema>& sceneSchema();

/// The section of that name; asking for one that is not there is a bug.
const SectionSchema& schemaSection(std::string_view name);

/// The sections "family/…", or the one section called `family`.
std::vector<const SectionSchema*> schemaVariants(std::string_view family);

/// The value of the key `type` selects a variant, or else the presence of its first key. The one that a
/// section uses.
bool variantByType(const SectionSchema& variant);
/// The word that picks the variant: "diffuse" of material/diffuse, "rgb" of spectrum/rgb.
std::string variantWord(const SectionSchema& variant);

/// Sections, outside `not_here`, that have a key of this name: for "'nee' is a key of integrator".
std::vector<std::string> sectionsWithKey(std::string_view key, std::string_view not_here);

}  // namespace crt
