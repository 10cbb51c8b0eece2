/// The files of `crt converge`: rows as they arrive (results.jsonl), the same as a table (results.csv), what
/// they amount to (summary.json), and what was run to get them (manifest.json). Units are in the names of
/// keys and columns; what is unknown is null or an empty field.
#pragma once

#include "judge/converge/fits.h"
#include "judge/converge/measurement.h"
#include "judge/converge/report_maps.h"

#include <string>
#include <vector>

namespace crt::converge {

/// results.jsonl being written: one JSON object a line, appended when its row arrives, so that an
/// interrupted run can be resumed. [one thread]
class ResultsLog {
public:
    /// Opens or creates it. A last line without an end (the run was killed while writing it) is cut off.
    /// Throws crt::Error(Output).
    explicit ResultsLog(const std::string& path);
    ~ResultsLog();
    ResultsLog(const ResultsLog&) = delete;
    ResultsLog& operator=(const ResultsLog&) = delete;

    /// A row with the key, replicate and samples of an earlier one replaces it: what becomes known later
    /// (between_replicates_mse) is written by appending the row again.
    void append(const Row& row);

private:
    std::string path_;
    int descriptor_ = -1;
};

/// The rows of results.jsonl in the order in which each first appeared. A torn last line is left out. No
/// file means no rows; anything else that is not a row is a crt::Error(Usage) with the line.
std::vector<Row> readResults(const std::string& path);

/// One line per row, in that order, with a header.
void writeCsv(const std::string& path, const std::vector<Row>& rows);

/// Fits, verdicts, references, stages and environment, and of every scene the findings, the void rows and
/// the files of its maps: all that a page about the run needs.
void writeSummary(const std::string& path, const Run& run, const Analysis& analysis,
                  const std::vector<MapSet>& maps);

/// Commands, environment, scenes and references with their hashes, and size and XXH3-128 of each of `files`,
/// which are names relative to the manifest's folder.
void writeManifest(const std::string& path, const Run& run, const std::vector<std::string>& files);

/// 32 hex digits, XXH3-128 of a file's bytes. Throws crt::Error(Usage) when it cannot be read.
std::string hashOfFile(const std::string& path);

/// "analytic", "quadrature", "independent", "none"
const char* referenceKindName(ReferenceKind kind);

}  // namespace crt::converge
