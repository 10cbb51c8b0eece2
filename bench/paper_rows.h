/// Reads the command line, times the runs and prints the rows of bench/paper_host.cpp and
/// bench/paper_gpu.cu.
#pragma once

#include "paper_work.h"

namespace paper {

/// `PROGRAM PART... [--quick] [--runs N] [--meshes DIR]`
struct Options {
    std::vector<std::string> parts;
    bool quick = false;  ///< Small: does it work? The figures mean nothing.
    int runs = 7;
    std::string meshes = "share/crt/meshes";

    bool has(const char* part) const { return std::find(parts.begin(), parts.end(), part) != parts.end(); }
};

inline Options optionsOf(int argc, char** argv, const std::vector<std::string>& known) {
    Options options;
    for (int i = 1; i < argc; ++i) {
        const std::string word = argv[i];
        if (word == "--quick") {
            options.quick = true;
        } else if ((word == "--runs" || word == "--meshes") && i + 1 < argc) {
            if (word == "--meshes")
                options.meshes = argv[++i];
            else
                options.runs = std::max(1, std::atoi(argv[++i]));
        } else if (std::find(known.begin(), known.end(), word) != known.end()) {
            options.parts.push_back(word);
        } else {
            std::string all;
            for (const std::string& part : known) all += " " + part;
            throw std::runtime_error("'" + word + "' is not known; parts are" + all +
                                     ", options --quick, --runs N and --meshes DIR");
        }
    }
    if (options.parts.empty()) options.parts = known;
    return options;
}

/// Number of values to sum: the paper's range.
inline std::vector<std::size_t> sumCounts(const Options& options) {
    if (options.quick) return {5'000, 1'000'003};
    return {5'000, 10'000, 100'000, 1'000'000, 10'000'000, 100'000'000};
}

/// Input of the boxes: a name and the corners of its triangles. "random" is none of the paper's: large
/// enough that memory is what limits.
struct Cloud {
    std::string name;
    std::vector<float> points;
};
inline std::vector<Cloud> clouds(const Options& options, Threads& threads) {
    std::vector<Cloud> all;
    for (const char* mesh : {"sphere", "figure", "dragon"})
        all.push_back({mesh, cornersOf(options.meshes + "/" + mesh + ".obj")});
    all.push_back({"random", numbers(std::size_t{9} * (options.quick ? 200'000 : 10'000'000), threads)});
    return all;
}

/// Sizes of the table that all rays sweep: the Cornell box's and the sphere's number of triangles, all of
/// the sphere.
constexpr std::uint32_t kTableSizes[] = {38, 960};

/// Seconds of one of several calls in a row of at least 2 ms, `runs` times, after two rows that are not
/// counted.
template <typename Call>
std::vector<double> timed(int runs, const Call& call) {
    const auto row = [&](int calls) {
        const auto begin = std::chrono::steady_clock::now();
        for (int i = 0; i < calls; ++i) call();
        return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    };
    row(1);
    const double once = row(1);
    const int calls = once > 2e-3 ? 1 : static_cast<int>(std::min(1000.0, 2e-3 / std::max(once, 1e-9) + 1));
    row(calls);
    std::vector<double> seconds;
    for (int i = 0; i < runs; ++i) seconds.push_back(row(calls) / calls);
    return seconds;
}

/// One line of the output, a JSON object.
class Row {
public:
    Row(const char* part, const char* where, const char* method) {
        text_ = "{\"part\": \"" + std::string(part) + "\"";
        word("where", where);
        word("method", method);
    }
    Row& word(const char* key, const std::string& value) {
        text_ += ", \"" + std::string(key) + "\": \"";
        for (const char c : value)
            if (c != '"' && c != '\\' && c >= ' ') text_ += c;
        text_ += "\"";
        return *this;
    }
    Row& number(const char* key, double value) {
        char digits[40];
        std::snprintf(digits, sizeof digits, "%.10g", value);
        text_ += ", \"" + std::string(key) + "\": " + digits;
        return *this;
    }
    Row& truth(const char* key, bool value) {
        text_ += ", \"" + std::string(key) + "\": " + (value ? "true" : "false");
        return *this;
    }
    Row& seconds(const std::vector<double>& values) {
        text_ += ", \"seconds\": [";
        for (std::size_t i = 0; i < values.size(); ++i) {
            char digits[40];
            std::snprintf(digits, sizeof digits, "%s%.6g", i ? ", " : "", values[i]);
            text_ += digits;
        }
        text_ += "]";
        return *this;
    }
    void print() const {
        std::puts((text_ + "}").c_str());
        std::fflush(stdout);
    }

private:
    std::string text_;
};

/// A row of a sum, and whether it is within its bound. `time`: what the seconds are of.
inline bool printSum(const char* where, const char* method, const char* time, std::size_t count, double sum,
                     double exact, double additions, const std::vector<double>& seconds) {
    const double bound = sumBound(exact, additions), error = std::abs(sum - exact);
    Row("sum", where, method)
        .word("time", time)
        .number("n", static_cast<double>(count))
        .number("error", error / exact)
        .number("bound", bound / exact)
        .truth("right", error <= bound)
        .seconds(seconds)
        .print();
    return error <= bound;
}

/// main() of both programs: what is wrong in one sentence, and exit code 1.
inline int reported(const char* program, const std::function<bool()>& work) {
    try {
        if (work()) return 0;
        std::fprintf(stderr, "%s: a result is not what it must be; its row says \"right\": false\n",
                     program);
    } catch (const std::exception& error) {
        std::fprintf(stderr, "%s: %s\n", program, error.what());
    }
    return 1;
}

}  // namespace paper
