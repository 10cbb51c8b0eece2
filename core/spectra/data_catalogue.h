/// Named data that come with crt: `{data: cornell/white}` in a scene, `crt data` on the command line.
///
/// Names are FAMILY/NAME. The tables that keys of the scene format name already (illuminants, glasses,
/// metals) are those of spectra_data.cpp; all others are files FAMILY/NAME.csv in dataDirectories()
/// (base/modules.h): two columns as readSpectrumFile() reads them, after the lines "# title",
/// "# source: …", "# quantity: …" and "# outside: clamp" or "zero". A comment line that begins with two
/// blanks continues the one before it. So everybody can add a family, in a folder of CRT_DATA_PATH.
#pragma once

#include "spectra/spectra.h"

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace crt {

/// One row of the catalogue. Metals have two columns, n and k, and every column can be named as a spectrum:
/// "metals/Au/n".
struct NamedData {
    std::string name{};
    std::string title{};
    std::string quantity{};  ///< "reflectance", "radiance", "refractive index".
    std::string source{};
    std::string outside{};   ///< Beyond the table: "clamp", "zero"; "formula" where nothing is beyond.
    std::string formula{};   ///< The formula that the table samples; empty: the table is the published data.
    std::string file{};      ///< Empty: built in.
    std::vector<double> wavelength_nm{};
    std::vector<std::string> columns{};
    std::vector<std::vector<double>> values{};  ///< One list a column.
};

/// All names of rows, families and names in alphabetical order.
std::vector<std::string> dataNames();

/// The names that `data:` takes: those of rows, and of a metal's columns instead of the metal.
std::vector<std::string> dataSpectrumNames();

/// A row, as published; nothing when there is none of that name. Throws crt::Error(Scene) for a file that
/// cannot be read or lacks its header.
std::optional<NamedData> findData(std::string_view name);

struct NamedSpectrum {
    Spectrum spectrum;
    std::string file;  ///< Empty: built in.
};

/// The spectrum of `data: name`; nothing if there is none of that name. Throws as findData().
std::optional<NamedSpectrum> dataSpectrum(std::string_view name);

}  // namespace crt
