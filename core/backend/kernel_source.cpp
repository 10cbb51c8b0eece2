#include "backend/kernel_source.h"

#include "backend/crt_layout_hash.h"
#include "base/code_trust.h"
#include "base/error.h"
#include "base/input_file.h"

#include <fmt/format.h>

#include <unistd.h>
#include <zstd.h>

#include <algorithm>
#include <cstdlib>
#include <map>
#include <mutex>
#include <set>
#include <utility>
#include <vector>

namespace crt {
namespace {

/// Kernel headers are named as they include each other: "kernel/geometry/ray.h". CRT_KERNEL_DIR is the
/// folder `kernel`.
constexpr std::string_view kRoot = "kernel/";

using TextOf = std::function<std::optional<std::string>(const std::string&)>;

/// All embedded headers, one after the other.
std::string unpackedKernels() {
    const KernelFile& last = kKernelFiles[kKernelFileCount - 1];
    std::string all(last.begin + last.size, '\0');
    const std::size_t size = ZSTD_decompress(all.data(), all.size(), kPackedKernels, kPackedKernelsSize);
    if (size != all.size()) throw Error(ErrorKind::Internal, "zstd cannot unpack the embedded kernels");
    return all;
}

std::optional<std::string> embeddedText(const std::string& name) {
    const KernelFile* end = kKernelFiles + kKernelFileCount;
    const KernelFile* found =
        std::find_if(kKernelFiles, end, [&](const KernelFile& file) { return name == file.name; });
    if (found == end) return std::nullopt;
    static const auto* const all = new std::string(unpackedKernels());
    return all->substr(found->begin, found->size);
}

std::optional<std::string> textIn(const std::string& directory, const std::string& name) {
    constexpr std::uint64_t kMostBytes = std::uint64_t{16} << 20;
    const std::string path = directory + name.substr(kRoot.size() - 1);
    if (::access(path.c_str(), F_OK) != 0) return std::nullopt;
    const trust::Judged judged = trust::judge(path);
    if (!judged.why.empty())
        throw Error(ErrorKind::Backend,
                    fmt::format("the kernels of CRT_KERNEL_DIR are refused: {}", judged.why));
    try {
        return readInput(judged.path, kMostBytes);
    } catch (const InputRefused& refused) {
        throw Error(ErrorKind::Backend, fmt::format("the kernel header '{}' {}", path, refused.what()));
    }
}

/// The directive of a preprocessor line ("include", "if", …) and what follows it; empty when the line is
/// none.
std::pair<std::string_view, std::string_view> directiveOf(std::string_view line) {
    const auto skip_blanks = [&] {
        line.remove_prefix(std::min(line.find_first_not_of(" \t"), line.size()));
    };
    skip_blanks();
    if (line.empty() || line.front() != '#') return {};
    line.remove_prefix(1);
    skip_blanks();
    const std::size_t end = std::min(line.find_first_not_of("abcdefghijklmnopqrstuvwxyz"), line.size());
    const std::string_view word = line.substr(0, end);
    line.remove_prefix(end);
    skip_blanks();
    return {word, line};
}

class Expander {
public:
    explicit Expander(const TextOf& text_of) : text_of_(text_of) {}

    /// `certain`: nothing but include guards stands around this header.
    void expand(const std::string& name, bool certain) {
        const std::optional<std::string> text = text_of_(name);
        if (!text) {
            throw Error(ErrorKind::Internal,
                        chain_.empty() ? fmt::format("there is no kernel header {}", name)
                                       : fmt::format("kernel header {} includes {}, which does not exist",
                                                     chain_.back(), name));
        }
        if (certain) done_.insert(name);
        chain_.push_back(name);
        // Compilers count lines of the whole text; these marks tell a reader of it where he is.
        out_ += fmt::format("/* ---- {} ---- */\n", name);

        int depth = 0;  // of conditions open within this header; the first is its guard
        for (std::string_view rest = *text; !rest.empty();) {
            const std::size_t length = std::min(rest.find('\n'), rest.size());
            const std::string_view line = rest.substr(0, length);
            rest.remove_prefix(std::min(length + 1, rest.size()));

            const auto [directive, argument] = directiveOf(line);
            if (directive == "if" || directive == "ifdef" || directive == "ifndef") ++depth;
            if (directive == "endif") --depth;
            const std::size_t quote = argument.find('"', 1);
            if (directive == "include" && !argument.empty() && argument.front() == '"' &&
                quote != std::string_view::npos) {
                include(std::string(argument.substr(1, quote - 1)), certain && depth <= 1);
            } else {
                out_.append(line);
                out_ += '\n';
            }
        }
        chain_.pop_back();
    }

    std::string take() { return std::move(out_); }

private:
    void include(const std::string& name, bool certain) {
        const bool running =
            std::find(chain_.begin(), chain_.end(), name) != chain_.end();  // a circle: the guard ends it
        if (!running && done_.count(name) == 0) expand(name, certain);
    }

    const TextOf& text_of_;
    std::set<std::string> done_;
    std::vector<std::string> chain_;
    std::string out_;
};

}  // namespace

std::string expandIncludes(const std::string& name, const TextOf& text_of) {
    Expander expander(text_of);
    expander.expand(name, true);
    return expander.take();
}

const char* kernelSource(const std::string& name) {
    const char* value = std::getenv("CRT_KERNEL_DIR");
    const std::string directory = value != nullptr ? value : "";
    if (name.rfind(kRoot, 0) != 0 || name.find("..") != std::string::npos) return nullptr;

    // Texts are kept for good, because plugins hold pointers to them. Leaked, so that they outlive every
    // static object.
    static std::mutex mutex;
    static auto* const texts = new std::map<std::pair<std::string, std::string>, std::string>;
    const std::lock_guard lock(mutex);
    const auto [place, is_new] = texts->try_emplace({directory, name});
    if (!is_new) return place->second.c_str();
    try {
        // The directory replaces the embedded texts as a whole: a kernel of two origins would be hard to
        // debug.
        const TextOf text_of = [&](const std::string& header) {
            return directory.empty() ? embeddedText(header) : textIn(directory, header);
        };
        if (!text_of(name)) {
            texts->erase(place);
            return nullptr;
        }
        if (!directory.empty()) {
            for (const char* header : {CRT_LAYOUT_HEADERS}) {
                if (text_of(header) != embeddedText(header)) {
                    throw Error(
                        ErrorKind::Backend,
                        fmt::format(
                            "CRT_KERNEL_DIR ({}) holds a {} that differs from the one in this crt: rebuild "
                            "crt",
                            directory, header));
                }
            }
        }
        place->second = expandIncludes(name, text_of);
        return place->second.c_str();
    } catch (...) {
        texts->erase(place);
        throw;
    }
}

}  // namespace crt
