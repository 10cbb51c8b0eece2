#include "scene/mesh/material_files.h"

#include "base/input_file.h"
#include "base/log.h"
#include "scene/mesh/obj_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <optional>
#include <utility>

namespace crt {
namespace {

namespace fs = std::filesystem;

bool isFile(const fs::path& path) {
    std::error_code ignored;  // Names that no file can have (too long) are not there either.
    return fs::is_regular_file(path, ignored);
}

bool sameLetters(const std::string& a, const std::string& b) {
    const auto lower = [](char c) { return std::tolower(static_cast<unsigned char>(c)); };
    return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                      [&](char x, char y) { return lower(x) == lower(y); });
}

class Finder {
public:
    Finder(const std::string& obj_path, MaterialFiles& out)
        : obj_path_(obj_path), folder_(fs::path(obj_path).parent_path()), out_(out) {}

    /// One mtllib statement. False when none of its names is there.
    bool library(const ObjContents::Library& library) {
        const std::string whole(unquoted(library.arguments));
        if (whole.empty()) return true;
        if (const std::optional<fs::path> path = find(whole, false)) {
            read(*path, whole, library.line);
            return true;
        }
        const std::vector<std::string_view> words = wordsOf(library.arguments);
        std::vector<std::string> missing;
        bool any = false;
        for (std::size_t i = 0; i < words.size();) {
            const std::size_t taken = wordsOfOneName(words, i, library.line);
            any |= taken > 0;
            if (taken == 0) missing.emplace_back(unquoted(words[i]));
            i += std::max<std::size_t>(taken, 1);
        }
        if (!any) {
            if (const std::optional<fs::path> path = find(whole, true)) {
                read(*path, whole, library.line);
                return true;
            }
            missing = {whole};
        }
        for (const std::string& name : missing) miss(name);
        return any;
    }

    /// The MTL with the name of the OBJ.
    void namesake(int line) {
        fs::path path = fs::path(obj_path_).replace_extension(".mtl");
        if (!isFile(path) || path.string() == obj_path_) return;
        const std::vector<std::string> missing = std::exchange(out_.missing, {});
        read(path, missing.front(), line);
    }

private:
    static std::string_view unquoted(std::string_view name) {
        const bool quoted =
            name.size() >= 2 && name.front() == name.back() && (name.front() == '"' || name.front() == '\'');
        return quoted ? name.substr(1, name.size() - 2) : name;
    }

    /// The file of this name in another case, folder by folder; of several, the first in the order of the
    /// alphabet.
    std::optional<fs::path> inAnotherCase(const fs::path& name) {
        fs::path found = folder_;
        for (const fs::path& part : name) {
            std::error_code ignored;
            const fs::path exact = found / part;
            if (part == "." || part == ".." || fs::exists(exact, ignored)) {
                found = exact;
                continue;
            }
            const std::vector<std::string>& entries = entriesOf(found);
            const auto like = std::find_if(entries.begin(), entries.end(), [&](const std::string& e) {
                return sameLetters(e, part.string());
            });
            if (like == entries.end()) return std::nullopt;
            found /= *like;
        }
        if (!isFile(found)) return std::nullopt;
        return found;
    }

    /// Read once a folder: an OBJ may name any number of files.
    const std::vector<std::string>& entriesOf(const fs::path& folder) {
        const auto [known, fresh] = entries_.try_emplace(folder.string());
        if (!fresh) return known->second;
        std::error_code ignored;
        for (fs::directory_iterator entry(folder.empty() ? fs::path(".") : folder, ignored), end;
             !ignored && entry != end; entry.increment(ignored))
            known->second.push_back(entry->path().filename().string());
        std::sort(known->second.begin(), known->second.end());
        return known->second;
    }

    static std::vector<std::string_view> wordsOf(std::string_view arguments) {
        std::vector<std::string_view> words;
        for (std::string_view word = nextField(arguments); !word.empty(); word = nextField(arguments))
            words.push_back(word);
        return words;
    }

    /// Reads the file whose name begins with words[first], and says how many words it has; 0 where there is
    /// no such file. Names with blanks are longer than they look, so the longest that is there wins.
    std::size_t wordsOfOneName(const std::vector<std::string_view>& words, std::size_t first, int line) {
        constexpr std::size_t kMostWords = 12;
        const std::size_t most =
            sameLetters(fs::path(words[first]).extension().string(), ".mtl") ? 1 : kMostWords;
        for (std::size_t count = std::min(words.size() - first, most); count > 0; --count) {
            const char* end = words[first + count - 1].data() + words[first + count - 1].size();
            const std::string name(
                unquoted({words[first].data(), static_cast<std::size_t>(end - words[first].data())}));
            const std::optional<fs::path> path = find(name, count == 1);
            if (!path) continue;
            read(*path, name, line);
            return count;
        }
        return 0;
    }

    std::optional<fs::path> find(const std::string& name, bool without_folders) {
        if (name.empty()) return std::nullopt;
        if (isFile(folder_ / name)) return folder_ / name;
        std::string slashed = name;
        // As tinyobjloader and its users write a blank.
        for (std::size_t at = 0; (at = slashed.find("\\ ", at)) != std::string::npos; ++at)
            slashed.erase(at, 1);
        if (isFile(folder_ / slashed)) return folder_ / slashed;
        std::replace(slashed.begin(), slashed.end(), '\\', '/');
        if (isFile(folder_ / slashed)) return folder_ / slashed;
        const fs::path path(slashed);
        if (!path.is_absolute())
            if (std::optional<fs::path> found = inAnotherCase(path)) return found;
        if (!without_folders || !path.has_filename()) return std::nullopt;
        return inAnotherCase(path.filename());
    }

    /// The first few are enough for a message.
    void miss(const std::string& name) {
        constexpr std::size_t kMostNamed = 4;
        if (out_.missing.size() < kMostNamed) out_.missing.push_back(name);
    }

    void read(const fs::path& path, const std::string& name, int line) {
        const std::string file = path.string();
        if (std::find(out_.files.begin(), out_.files.end(), file) != out_.files.end()) return;
        if (path != folder_ / name)
            logWarning("{}:{}: the material file {} does not exist; crt read {} instead", obj_path_, line,
                       inQuotes(name), inQuotes(file));
        std::string text;
        try {
            text = readTextFile(file, "material file", kMostMaterialBytes, {obj_path_, line});
        } catch (const Error& e) {
            logWarning("{}:{}: {}", obj_path_, line, e.what());
            miss(name);
            return;
        }
        out_.files.push_back(file);
        int repeated = 0, first_repeated = 0;
        for (MtlText& material : readMtl(text, file)) {
            const int at = material.line;
            std::string material_name = material.name;
            if (!out_.materials.try_emplace(std::move(material_name), std::move(material)).second &&
                ++repeated == 1)
                first_repeated = at;
        }
        if (repeated > 0)
            logWarning("{}:{}: {} material{} defined before; the first definition counts", file,
                       first_repeated, repeated, repeated == 1 ? " was" : "s were");
    }

    const std::string& obj_path_;
    fs::path folder_;
    MaterialFiles& out_;
    std::map<std::string, std::vector<std::string>> entries_;  ///< Names in a folder, sorted.
};

}  // namespace

MaterialFiles readMaterialFiles(const ObjContents& obj, const std::string& obj_path) {
    MaterialFiles out;
    Finder finder(obj_path, out);
    bool any = false;
    for (const ObjContents::Library& library : obj.libraries) any |= finder.library(library);
    if (!any && !out.missing.empty()) finder.namesake(obj.libraries.front().line);
    return out;
}

}  // namespace crt
