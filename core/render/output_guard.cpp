#include "render/output_guard.h"

#include "base/atomic_file.h"
#include "base/error.h"
#include "base/log.h"
#include "film/checkpoint.h"
#include "image/image_io.h"

#include <fmt/format.h>

#include <filesystem>
#include <fstream>
#include <limits>
#include <string_view>
#include <sys/stat.h>
#include <system_error>

namespace crt {
namespace fs = std::filesystem;
namespace {

fs::path wholeName(const fs::path& path) {
    std::error_code unknown;
    const fs::path absolute = fs::absolute(path, unknown);
    const fs::path found = fs::weakly_canonical(absolute, unknown);
    return unknown ? absolute.lexically_normal() : found;
}

/// The same for all names of one file: by device and number of the file that is there, or by the name that
/// it will have.
std::string identityOf(const std::string& path) {
    struct stat status {};
    if (::stat(path.c_str(), &status) == 0) return fmt::format("{}:{}", status.st_dev, status.st_ino);
    return wholeName(path).string();
}

/// `path` relative to `folder`; empty if it lies outside.
fs::path below(const fs::path& folder, const fs::path& path) {
    const fs::path way = wholeName(path).lexically_relative(wholeName(folder));
    return way.empty() || *way.begin() == ".." || way == "." ? fs::path() : way;
}

/// True if a file begins as the images that crt writes. EXR, PNG and JPEG also name crt in their metadata.
bool isImageOfCrt(const std::string& path, OutputFormat format) {
    constexpr std::size_t kMetadata = 65536;
    std::ifstream file(path, std::ios::binary);
    std::string head(kMetadata, '\0');
    file.read(head.data(), static_cast<std::streamsize>(head.size()));
    head.resize(static_cast<std::size_t>(file.gcount()));
    const auto begins = [&](std::string_view with) { return head.rfind(with, 0) == 0; };
    const std::size_t program = head.find("Software");
    const bool named =
        program != std::string::npos && head.substr(program, 32).find("crt ") != std::string::npos;
    switch (format) {
        case OutputFormat::Exr: return begins("\x76\x2f\x31\x01") && named;
        case OutputFormat::Png: return begins("\x89PNG") && named;
        case OutputFormat::Jpeg: return begins("\xff\xd8\xff") && named;
        case OutputFormat::Ppm: return begins("P6");
        case OutputFormat::Pfm: return begins("PF") || begins("Pf");
    }
    return false;
}

constexpr std::uint64_t kNoFilm =
    std::numeric_limits<std::uint64_t>::max();  // Larger than any, so that it is never replaced.

/// Identity of a file and of its contents, by inode, size and time; empty if there is no file.
std::string fileAt(const std::string& path) {
    struct stat status {};
    if (::stat(path.c_str(), &status) != 0) return {};
    return fmt::format("{}:{}:{}:{}.{}", status.st_dev, status.st_ino, status.st_size,
                       status.st_mtim.tv_sec, status.st_mtim.tv_nsec);
}

/// Samples per pixel of a film. A file that is not a film counts as the largest, so that it stays.
std::uint64_t samplesAt(const std::string& path) {
    try {
        return readCheckpoint(path).first.samples.count();
    } catch (const Error&) {
        return kNoFilm;
    }
}

}  // namespace

void refuseOverInputs(const std::vector<std::string>& inputs, const std::vector<std::string>& outputs,
                      const std::vector<std::string>& films) {
    std::map<std::string, std::string> read, written;  // By identity, the name.
    for (const std::string& input : inputs) read.emplace(identityOf(input), input);
    const auto check = [&](const std::string& output) {
        const std::string identity = identityOf(output);
        if (const auto input = read.find(identity); input != read.end())
            throw Error(
                ErrorKind::Usage,
                output == input->second
                    ? fmt::format("the output '{}' would replace an input file", output)
                    : fmt::format("the output '{}' would replace the input '{}': they are the same file",
                                  output, input->second),
                {output});
        if (const auto other = written.find(identity); other != written.end())
            throw Error(ErrorKind::Usage,
                        output == other->second
                            ? fmt::format("two outputs have the same name '{}'", output)
                            : fmt::format("the outputs '{}' and '{}' are the same file",
                                          other->second, output));
        return identity;
    };
    for (const std::string& output : outputs) written.emplace(check(output), output);
    for (const std::string& film : films) check(film);
}

void refuseForeignPlaces(const std::vector<Output>& outputs, const std::string& scene_file, bool replace) {
    const fs::path folder = fs::path(scene_file).parent_path();
    for (const Output& output : outputs) {
        if (isStandardOutput(output.file)) continue;
        const auto refuse = [&](const std::string& why) {
            throw Error(ErrorKind::Usage,
                        fmt::format("the scene's output '{}' {}; -o accepts any file",
                                    output.file, why),
                        {output.file});
        };
        fs::path way = below(".", output.file);
        if (way.empty()) way = below(folder.empty() ? "." : folder, output.file);
        if (way.empty())
            refuse("lies outside the working directory and the folder of the scene");
        for (const fs::path& part : way)
            if (part.string().front() == '.') refuse("is a hidden file or lies in a hidden folder");
        if (!formatOfFile(output.file)) refuse(fmt::format("does not end in {}", kImageEnds));
        std::error_code unreadable;
        if (!replace && fs::exists(output.file, unreadable) && !isImageOfCrt(output.file, output.format))
            refuse("would replace a file that crt did not write; add --overwrite to replace it");
    }
}

void FilmGuard::look(const std::string& path, bool wanted, bool replace) {
    if (const auto known = places_.find(path); known != places_.end()) {
        known->second.wanted = known->second.wanted || wanted;
        return;
    }
    std::error_code unreadable;
    Place place;
    place.wanted = wanted;
    if (!replace && fs::exists(path, unreadable)) {
        try {
            place.samples = readCheckpoint(path).first.samples.count();
        } catch (const Error& error) {
            if (wanted)
                throw Error(ErrorKind::Usage,
                            fmt::format("a film would replace '{}', which is not a film: {}; choose another "
                                        "name, or add --overwrite",
                                        path, error.what()),
                            {path});
            place.samples = kNoFilm;
        }
    }
    place.file = fileAt(path);
    places_[path] = place;
}

void FilmGuard::goOnFrom(const std::string& path) { places_[path].file = fileAt(path); }

void FilmGuard::requireRoom(std::uint64_t samples) const {
    for (const auto& [path, place] : places_)
        if (place.wanted && place.samples > samples)
            throw Error(ErrorKind::Usage,
                        fmt::format("'{}' holds {} samples per pixel and would be replaced by {}: add "
                                    "--resume to continue it, or --overwrite to replace it, or choose "
                                    "another name",
                                    path, place.samples, samples),
                        {path});
}

std::string FilmGuard::placeFor(const std::string& path, std::uint64_t samples) {
    const auto found = places_.find(path);
    if (found == places_.end()) return path;
    if (const std::string now = fileAt(path); now != found->second.file) {
        found->second.file = now;
        found->second.samples = now.empty() ? 0 : samplesAt(path);
        if (found->second.samples > samples)
            logWarning("another program has written '{}' in the meantime; it holds more samples and is kept",
                       path);
    }
    if (samples >= found->second.samples) return path;
    std::string& beside = found->second.beside;
    std::error_code unreadable;
    const std::string stem = fs::path(path).replace_extension().string();
    for (int number = 1; beside.empty(); ++number) {
        const std::string name = fmt::format("{}.partial{}{}", stem,
                                             number > 1 ? std::to_string(number) : "", kCheckpointExtension);
        if (!fs::exists(fs::symlink_status(name, unreadable))) beside = name;
    }
    return beside;
}

void FilmGuard::written(const std::string& path) {
    const auto found = places_.find(path);
    if (found == places_.end()) return;
    found->second.samples = 0;  // The existing file was written by this run.
    found->second.file = fileAt(path);
    if (found->second.beside.empty()) return;
    std::error_code gone;
    fs::remove(found->second.beside, gone);
    found->second.beside.clear();
}

}  // namespace crt
