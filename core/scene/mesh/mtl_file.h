/// The text of MTL files → what each material says, before anything is made of it.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace crt {

/// One statement of a material: what follows the keyword, and where.
struct MtlStatement {
    std::string arguments;
    int line = 0;
};

/// A material as its file states it.
struct MtlText {
    std::string name;
    std::string file;
    int line = 0;
    /// By keyword, spelled as mtlKeys() does; of several with one keyword, the last. Others as in the file.
    std::map<std::string, MtlStatement, std::less<>> statements;

    const MtlStatement* find(std::string_view keyword) const;
};

/// A keyword of MTL and what crt makes of it, in Markdown. docs/scene.md shows this table, and the reader
/// knows these keywords and no others.
struct MtlKey {
    std::string keyword;
    std::vector<std::string> aliases;
    std::string arguments;
    std::string doc;
};
const std::vector<MtlKey>& mtlKeys();

/// The row of a keyword, in whatever case and under any alias; null for those that are unknown.
const MtlKey* findMtlKey(std::string_view keyword);

/// The materials of a file; a newmtl without a name makes one for usemtl without a name. Statements that
/// belong to none are left out, with a warning.
std::vector<MtlText> readMtl(std::string_view text, const std::string& path);

}  // namespace crt
