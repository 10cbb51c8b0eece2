#include "judge/converge/files.h"

#include "base/byte_hash.h"
#include "base/error.h"
#include "base/input_file.h"
#include "base/json_integer.h"
#include "judge/converge/json_parts.h"

#include <fmt/format.h>

// In the header's inline form, so that nothing has to be linked or found at run time.
#include <fcntl.h>
#include <unistd.h>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <limits>
#include <map>
#include <tuple>

namespace crt::converge {
namespace {

namespace fs = std::filesystem;

double numberIn(const Json& value) {
    return value.is_null() ? std::numeric_limits<double>::quiet_NaN() : value.get<double>();
}
std::optional<double> knownNumberIn(const Json& value) {
    return value.is_null() ? std::nullopt : std::optional(value.get<double>());
}
std::array<double, 3> numbersIn(const Json& value) {
    return {numberIn(value.at(0)), numberIn(value.at(1)), numberIn(value.at(2))};
}

// ----------------------------------------------------------------------------------------------------- rows

Json errorJson(const ErrorMetrics& e) {
    return {{"mse", number(e.mse)},
            {"rmse", number(e.rmse)},
            {"relative_rmse", number(e.relative_rmse)},
            {"relmse", number(e.relmse)},
            {"smape", number(e.smape)},
            {"mae", number(e.mae)},
            {"max_absolute", number(e.max_absolute)},
            {"flip_mean", number(e.flip_mean)},
            {"delta_e2000_mean", number(e.delta_e2000_mean)}};
}

ErrorMetrics errorOf(const Json& json) {
    ErrorMetrics e;
    e.mse = numberIn(json.at("mse"));
    e.rmse = numberIn(json.at("rmse"));
    e.relative_rmse = numberIn(json.at("relative_rmse"));
    e.relmse = numberIn(json.at("relmse"));
    e.smape = numberIn(json.at("smape"));
    e.mae = numberIn(json.at("mae"));
    e.max_absolute = numberIn(json.at("max_absolute"));
    e.flip_mean = knownNumberIn(json.at("flip_mean"));
    e.delta_e2000_mean = knownNumberIn(json.at("delta_e2000_mean"));
    return e;
}

Json rowJson(const Row& row) {
    Json json;
    json["scene"] = row.key.scene;
    json["backend"] = row.key.backend;
    json["variant"] = row.key.variant;
    json["seed"] = row.seed;
    json["replicate"] = row.replicate;
    json["samples_per_pixel"] = row.samples;
    json["render_wall_seconds"] = number(row.render_wall_seconds);
    json["render_device_seconds"] = number(row.render_device_seconds);
    json["seconds_before_first_sample"] = number(row.seconds_before_first_sample);
    json["paths"] = row.paths;
    json["closest_rays"] = row.closest_rays;
    json["shadow_rays"] = row.shadow_rays;
    json["error"] = row.error ? errorJson(*row.error) : Json(nullptr);
    json["fold_mse"] = Json::array();
    for (const double mse : row.fold_mse) json["fold_mse"].push_back(number(mse));
    json["between_replicates_mse"] = number(row.between_replicates_mse);
    json["effective_pixels"] = number(row.effective_pixels);
    json["heavy_tail_values"] = number(row.heavy_tail_values);
    json["predicted_relative_rmse"] = interval(row.predicted_relative_rmse);
    json["rare_luminance"] = number(row.rare_luminance);
    json["mean_luminance"] = number(row.mean_luminance);
    json["image_mean"] = numbers(row.image_mean);
    json["image_mean_standard_error"] =
        row.image_mean_standard_error ? numbers(*row.image_mean_standard_error) : Json(nullptr);
    json["invalid_samples"] = row.invalid_samples;
    json["void"] = row.isVoid();  // For readers; what makes it so is above.
    json["cpu_clock_mhz"] = number(row.cpu_clock_mhz);
    json["load_average"] = number(row.load_average);
    json["stop_reason"] = row.stop_reason;
    return json;
}

Row rowOf(const Json& json) {
    Row row;
    row.key = {json.at("scene").get<std::string>(), json.at("backend").get<std::string>(),
               json.at("variant").get<std::string>()};
    row.seed = wholeNumber(json.at("seed"));
    row.replicate = static_cast<std::uint32_t>(
        wholeNumber(json.at("replicate"), std::numeric_limits<std::uint32_t>::max()));
    row.samples = wholeNumber(json.at("samples_per_pixel"));
    row.render_wall_seconds = numberIn(json.at("render_wall_seconds"));
    row.render_device_seconds = knownNumberIn(json.at("render_device_seconds"));
    row.seconds_before_first_sample = knownNumberIn(json.at("seconds_before_first_sample"));
    row.paths = wholeNumber(json.at("paths"));
    row.closest_rays = wholeNumber(json.at("closest_rays"));
    row.shadow_rays = wholeNumber(json.at("shadow_rays"));
    if (const Json& error = json.at("error"); !error.is_null()) row.error = errorOf(error);
    for (const Json& mse : json.at("fold_mse")) row.fold_mse.push_back(numberIn(mse));
    row.between_replicates_mse = knownNumberIn(json.at("between_replicates_mse"));
    row.effective_pixels = knownNumberIn(json.at("effective_pixels"));
    row.heavy_tail_values = knownNumberIn(json.at("heavy_tail_values"));
    if (const Json& predicted = json.at("predicted_relative_rmse"); !predicted.is_null())
        row.predicted_relative_rmse = Estimate{
            numberIn(predicted.at("value")), numberIn(predicted.at("low")), numberIn(predicted.at("high"))};
    row.rare_luminance = numberIn(json.at("rare_luminance"));
    row.mean_luminance = numberIn(json.at("mean_luminance"));
    row.image_mean = numbersIn(json.at("image_mean"));
    if (const Json& error = json.at("image_mean_standard_error"); !error.is_null())
        row.image_mean_standard_error = numbersIn(error);
    row.invalid_samples = wholeNumber(json.at("invalid_samples"));
    row.cpu_clock_mhz = knownNumberIn(json.at("cpu_clock_mhz"));
    row.load_average = knownNumberIn(json.at("load_average"));
    row.stop_reason = json.at("stop_reason").get<std::string>();
    return row;
}

[[noreturn]] void cannotWrite(const std::string& path) {
    throw Error(ErrorKind::Output, fmt::format("cannot write '{}': {}", path, std::strerror(errno)), {path});
}

// ------------------------------------------------------------------------------------------------------ csv

/// A field of RFC 4180: quoted where it has to be.
std::string csvField(const std::string& text) {
    if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
    std::string quoted = "\"";
    for (const char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
    return quoted + '"';
}
std::string csvField(double value) {
    return std::isfinite(value) ? fmt::format("{}", value) : std::string();
}
std::string csvField(std::uint64_t value) { return std::to_string(value); }
std::string csvField(const std::optional<double>& value) { return value ? csvField(*value) : std::string(); }

struct Column {
    const char* name;
    std::function<std::string(const Row&)> field;
};

/// A column that is empty where the row has no reference.
template <typename Member>
std::function<std::string(const Row&)> errorField(Member ErrorMetrics::*member) {
    return [member](const Row& row) { return row.error ? csvField((*row.error).*member) : std::string(); };
}

std::function<std::string(const Row&)> predictionField(double Estimate::*member) {
    return [member](const Row& row) {
        return row.predicted_relative_rmse ? csvField((*row.predicted_relative_rmse).*member)
                                           : std::string();
    };
}

std::function<std::string(const Row&)> standardErrorField(std::size_t channel) {
    return [channel](const Row& row) {
        return row.image_mean_standard_error ? csvField((*row.image_mean_standard_error)[channel])
                                             : std::string();
    };
}

const std::vector<Column>& csvColumns() {
    static const std::vector<Column> columns{
        {"scene", [](const Row& r) { return csvField(r.key.scene); }},
        {"backend", [](const Row& r) { return csvField(r.key.backend); }},
        {"variant", [](const Row& r) { return csvField(r.key.variant); }},
        {"seed", [](const Row& r) { return csvField(r.seed); }},
        {"replicate", [](const Row& r) { return csvField(std::uint64_t{r.replicate}); }},
        {"samples_per_pixel", [](const Row& r) { return csvField(r.samples); }},
        {"render_wall_seconds", [](const Row& r) { return csvField(r.render_wall_seconds); }},
        {"render_device_seconds", [](const Row& r) { return csvField(r.render_device_seconds); }},
        {"seconds_before_first_sample",
         [](const Row& r) { return csvField(r.seconds_before_first_sample); }},
        {"paths", [](const Row& r) { return csvField(r.paths); }},
        {"closest_rays", [](const Row& r) { return csvField(r.closest_rays); }},
        {"shadow_rays", [](const Row& r) { return csvField(r.shadow_rays); }},
        {"mse", errorField(&ErrorMetrics::mse)},
        {"rmse", errorField(&ErrorMetrics::rmse)},
        {"relative_rmse", errorField(&ErrorMetrics::relative_rmse)},
        {"relmse", errorField(&ErrorMetrics::relmse)},
        {"smape", errorField(&ErrorMetrics::smape)},
        {"mae", errorField(&ErrorMetrics::mae)},
        {"max_absolute", errorField(&ErrorMetrics::max_absolute)},
        {"flip_mean", errorField(&ErrorMetrics::flip_mean)},
        {"delta_e2000_mean", errorField(&ErrorMetrics::delta_e2000_mean)},
        {"between_replicates_mse", [](const Row& r) { return csvField(r.between_replicates_mse); }},
        {"predicted_relative_rmse", predictionField(&Estimate::value)},
        {"predicted_relative_rmse_low", predictionField(&Estimate::low)},
        {"predicted_relative_rmse_high", predictionField(&Estimate::high)},
        {"effective_pixels", [](const Row& r) { return csvField(r.effective_pixels); }},
        {"heavy_tail_values", [](const Row& r) { return csvField(r.heavy_tail_values); }},
        {"rare_luminance", [](const Row& r) { return csvField(r.rare_luminance); }},
        {"mean_luminance", [](const Row& r) { return csvField(r.mean_luminance); }},
        {"image_mean_r", [](const Row& r) { return csvField(r.image_mean[0]); }},
        {"image_mean_g", [](const Row& r) { return csvField(r.image_mean[1]); }},
        {"image_mean_b", [](const Row& r) { return csvField(r.image_mean[2]); }},
        {"image_mean_standard_error_r", standardErrorField(0)},
        {"image_mean_standard_error_g", standardErrorField(1)},
        {"image_mean_standard_error_b", standardErrorField(2)},
        {"invalid_samples", [](const Row& r) { return csvField(r.invalid_samples); }},
        {"void", [](const Row& r) { return std::string(r.isVoid() ? "1" : "0"); }},
        {"cpu_clock_mhz", [](const Row& r) { return csvField(r.cpu_clock_mhz); }},
        {"load_average", [](const Row& r) { return csvField(r.load_average); }},
        {"stop_reason", [](const Row& r) { return csvField(r.stop_reason); }},
    };
    return columns;
}

}  // namespace

const char* referenceKindName(ReferenceKind kind) {
    switch (kind) {
        case ReferenceKind::Analytic: return "analytic";
        case ReferenceKind::Quadrature: return "quadrature";
        case ReferenceKind::Independent: return "independent";
        case ReferenceKind::None: break;
    }
    return "none";
}

ResultsLog::ResultsLog(const std::string& path) : path_(path) {
    descriptor_ = ::open(path.c_str(), O_RDWR | O_CREAT | O_APPEND | O_CLOEXEC, 0666);
    if (descriptor_ < 0) cannotWrite(path);
    off_t end = ::lseek(descriptor_, 0, SEEK_END);
    for (char last = 0; end > 0; --end) {
        if (::pread(descriptor_, &last, 1, end - 1) != 1) break;
        if (last == '\n') break;
    }
    if (end < 0 || ::ftruncate(descriptor_, end) != 0) {
        ::close(descriptor_);
        cannotWrite(path);
    }
}

ResultsLog::~ResultsLog() { ::close(descriptor_); }

void ResultsLog::append(const Row& row) {
    const std::string line = rowJson(row).dump(-1, ' ', false, Json::error_handler_t::replace) + '\n';
    for (std::size_t written = 0; written < line.size();) {
        const ssize_t count = ::write(descriptor_, line.data() + written, line.size() - written);
        if (count < 0 && errno != EINTR) cannotWrite(path_);
        if (count > 0) written += static_cast<std::size_t>(count);
    }
}

std::vector<Row> readResults(const std::string& path) {
    std::vector<Row> rows;
    std::error_code ignored;
    if (!fs::exists(path, ignored)) return rows;
    try {
        requireInput(path);
    } catch (const InputRefused& refused) {
        throw Error(ErrorKind::Usage, fmt::format("'{}' {}", path, refused.what()), {path});
    }
    std::ifstream file(path, std::ios::binary);
    std::map<std::tuple<Key, std::uint32_t, std::uint64_t>, std::size_t> place;
    int line_number = 0;
    for (std::string line; std::getline(file, line);) {
        ++line_number;
        if (file.eof()) break;  // No end of line: torn.
        const auto refuse = [&](const char* why) {
            throw Error(ErrorKind::Usage,
                        fmt::format("this line is not a row of 'crt converge' ({}); remove it, or write to "
                                    "a new folder",
                                    why),
                        {path, line_number});
        };
        try {
            Row row = rowOf(Json::parse(line));
            const auto [found, is_new] =
                place.try_emplace({row.key, row.replicate, row.samples}, rows.size());
            if (is_new)
                rows.push_back(std::move(row));
            else
                rows[found->second] = std::move(row);
        } catch (const nlohmann::json::exception& e) {
            refuse(e.what());
        } catch (const Error& e) {
            refuse(e.what());
        }
    }
    if (file.bad() || !file.eof())
        throw Error(ErrorKind::Usage, fmt::format("cannot read '{}'", path), {path});
    return rows;
}

void writeCsv(const std::string& path, const std::vector<Row>& rows) {
    std::string text;
    const auto add_line = [&](const std::function<std::string(const Column&)>& field) {
        for (const Column& column : csvColumns()) text += field(column) + ',';
        text.back() = '\n';
    };
    add_line([](const Column& column) { return std::string(column.name); });
    for (const Row& row : rows) add_line([&](const Column& column) { return column.field(row); });
    writeWhole(path, text);
}

std::string hashOfFile(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    ByteHash hash;
    std::vector<char> buffer(1 << 16);
    while (file.read(buffer.data(), static_cast<std::streamsize>(buffer.size())) || file.gcount() > 0)
        hash.add(buffer.data(), static_cast<std::size_t>(file.gcount()));
    if (file.bad() || !file.eof())
        throw Error(ErrorKind::Usage, fmt::format("cannot read '{}'", path), {path});
    return hash.digits128();
}

void writeManifest(const std::string& path, const Run& run, const std::vector<std::string>& files) {
    Json json;
    json["format"] = "crt converge 1";
    json["environment"] = environmentJson(run.environment);
    json["scenes"] = Json::array();
    std::map<std::string, std::string> listed;
    for (const Configuration& c : run.configurations)
        if (c.omitted.empty() && listed.emplace(c.scene_file + c.scene_hash, c.key.scene).second)
            json["scenes"].push_back(
                {{"scene", c.key.scene}, {"file", c.scene_file}, {"compiled_hash", c.scene_hash}});
    json["references"] = Json::array();
    for (const ReferenceInfo& reference : run.references)
        json["references"].push_back(referenceJson(reference));
    json["files"] = Json::array();
    for (const std::string& name : files) {
        const fs::path file = fs::path(path).parent_path() / name;
        const std::string hash = hashOfFile(file.string());
        json["files"].push_back({{"name", name}, {"bytes", fs::file_size(file)}, {"xxh3_128", hash}});
    }
    writeWhole(path, json.dump(1, ' ', false, Json::error_handler_t::replace) + '\n');
}

}  // namespace crt::converge
