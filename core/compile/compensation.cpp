#include "compile/compensation.h"

#include "base/parallel.h"
#include "compile/reflectance.h"
#include "compile/visible_normals.h"
#include "kernel/bsdf.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <functional>
#include <tuple>
#include <utility>

namespace crt {
namespace {

constexpr std::size_t kLossSteps = static_cast<std::size_t>(CRT_LOSS_STEPS), kStride = CRT_LOSS_STRIDE;
static_assert(kLossSteps + 2 == static_cast<std::size_t>(CRT_LOSS_MEAN) &&
              kLossSteps + 3 == static_cast<std::size_t>(CRT_LOSS_PASSED) &&
              kLossSteps + 4 < CRT_LOSS_SHARES && CRT_LOSS_SHARES + kLossSteps + 1 < kStride);

/// Rows along a textured roughness, and the most along an index that depends on the wavelength: one for each
/// 0.02 of it.
constexpr std::uint32_t kRoughnesses = 33, kMostIndices = 33;
constexpr double kIndexStep = 0.02;
/// The same of anisotropic ones, of which each index has as many rows as there are azimuths.
constexpr double kWideIndexStep = 0.1;

/// Sets the mean of a row, 2 ∫ L c dc of what the kernel reads between its nodes: linear in t = √c,
/// where it is 4 ∫ L t³ dt. And the shares of the steps in it.
void integrate(float* row) {
    std::array<double, kLossSteps + 1> below{};
    for (std::size_t cell = 0; cell < kLossSteps; ++cell) {
        const double i = static_cast<double>(cell), first = row[cell], step = row[cell + 1] - first;
        below[cell + 1] = below[cell] + first * (((i + 1.5) * i + 1) * i + 0.25) +
                          step * (((i / 2 + 1) * i + 0.75) * i + 0.2);
    }
    constexpr double n = kLossSteps;
    row[kLossSteps + 2] = static_cast<float>(4 * below[kLossSteps] / (n * n * n * n));
    for (std::size_t i = 0; i <= kLossSteps; ++i)
        row[CRT_LOSS_SHARES + i] = static_cast<float>(below[i] / below[kLossSteps]);
}

/// Direction of the azimuth that crt_azimuth takes for `at`, at a cosine.
Vec3d atAzimuth(double at, double cosine, double narrowing) {
    const double x = 1 - at, y = at / std::sqrt(narrowing), size = std::sqrt(x * x + y * y);
    const double sine = std::sqrt(std::max(0.0, 1 - cosine * cosine));
    return {sine * x / size, sine * y / size, cosine};
}

/// The share of all azimuths that each row stands for, of what is linear between them.
std::array<double, CRT_LOSS_AZIMUTHS> azimuthShares(double narrowing) {
    static const auto azimuths = halfCircle<4096>();
    std::array<double, CRT_LOSS_AZIMUTHS> shares{};
    for (const auto& [x, y] : azimuths) {
        const double across = std::sqrt(narrowing) * y, along = std::abs(x);
        const double at = across / (along + across) * (CRT_LOSS_AZIMUTHS - 1.0);
        const std::size_t i = std::min<std::size_t>(static_cast<std::size_t>(at), CRT_LOSS_AZIMUTHS - 2);
        const double f = at - static_cast<double>(i);
        shares[i] += (1 - f) / static_cast<double>(azimuths.size());
        shares[i + 1] += f / static_cast<double>(azimuths.size());
    }
    return shares;
}

/// Gives the rows of all azimuths, `step` apart, the mean and the shares of the whole.
void integrateAzimuths(float* rows, std::size_t step, double narrowing) {
    const auto azimuths = azimuthShares(narrowing);
    std::array<float, kStride> mean{};
    for (std::size_t i = 0; i <= kLossSteps + 1; ++i) {
        double sum = 0;
        for (std::size_t a = 0; a < azimuths.size(); ++a)
            sum += azimuths[a] * static_cast<double>(rows[a * step + i]);
        mean[i] = static_cast<float>(sum);
    }
    integrate(mean.data());
    for (std::size_t a = 0; a < azimuths.size(); ++a) {
        rows[a * step + kLossSteps + 2] = mean[kLossSteps + 2];
        std::copy(mean.begin() + CRT_LOSS_SHARES, mean.end(), rows + a * step + CRT_LOSS_SHARES);
    }
}

/// As the kernel decides it.
bool isSmooth(double roughness) {
    const float r = static_cast<float>(roughness);
    return !(r * r >= CRT_ALPHA_MIN);
}

/// What a table depends on.
struct TableKey {
    bool refracts;
    double least, most;  ///< Index, inside over outside.
    bool textured;
    double roughness;
    double narrowing;  ///< 0: isotropic; else `roughness` is the root of the width along the tangent.
    auto operator<=>(const TableKey&) const = default;
};

TableKey tableKeyOf(const Material& material) {
    TableKey key{};
    key.refracts = material.type == MaterialType::RoughDielectric;
    if (key.refracts) std::tie(key.least, key.most) = std::pair(material.eta.min(), material.eta.max());
    key.textured = material.roughness_texture != kNoTexture;
    if (!key.textured) key.roughness = material.roughness;
    if (const Anisotropy a = anisotropyOf(material); a.narrowing > 0) {
        key.narrowing = a.narrowing;
        key.roughness = material.roughness * std::sqrt(a.widening);
    }
    return key;
}

/// What a row of a table is of: one index, or a film at one wavelength.
struct Interface {
    double index = 0;                        ///< Inside over outside; 0: a metal.
    double film_index = 0, film_rounds = 0;  ///< Relative to the outside; 2 d / λ. 0: there is none.
};

/// What rows of a table are made for, side by side.
struct Across {
    std::vector<Interface> interfaces{{}};
    double first = 0, step = 1;  ///< Of what the kernel looks rows up by.
};

Across acrossIndices(const TableKey& key) {
    Across across;
    const double range = key.most - key.least, step = key.narrowing > 0 ? kWideIndexStep : kIndexStep;
    const auto steps = static_cast<std::size_t>(std::min(kMostIndices - 1.0, std::ceil(range / step)));
    across.first = key.least;
    if (steps > 0) across.step = range / static_cast<double>(steps);
    across.interfaces.resize(steps + 1);
    for (std::size_t i = 0; i <= steps; ++i)
        across.interfaces[i].index = key.least + static_cast<double>(i) * across.step;
    return across;
}

/// Wavelengths so close that a fringe of the film has eight of them.
Across acrossWavelengths(const Material& material) {
    constexpr double kLast = kSpectrumSize - 1;
    const double fringes = 2 * material.film_thickness_nm * material.film_index.max() *
                           (1 / kWavelengthMin_nm - 1 / (kWavelengthMin_nm + kLast));
    const auto steps = static_cast<std::size_t>(std::clamp(std::ceil(8 * fringes), 8.0, 64.0));
    Across across;
    across.step = kLast / static_cast<double>(steps);
    across.interfaces.resize(steps + 1);
    for (std::size_t i = 0; i <= steps; ++i) {
        const double position = static_cast<double>(i) * across.step;
        const auto at = [&](const Spectrum& s) {
            const auto n = std::min<std::size_t>(static_cast<std::size_t>(position), kSpectrumSize - 2);
            return s[n] + (position - static_cast<double>(n)) * (s[n + 1] - s[n]);
        };
        across.interfaces[i] = {at(material.eta), at(material.film_index),
                                2 * material.film_thickness_nm / (kWavelengthMin_nm + position)};
    }
    return across;
}

/// Reflectance of a film by the cosine, from one side: the kernel's, so that both are of one mind.
class FilmReflectance {
public:
    FilmReflectance(const Interface& film, bool inside) : values_(kCells + 2) {
        const double before = inside ? film.index : 1;
        for (std::size_t i = 0; i < values_.size(); ++i)
            values_[i] = static_cast<double>(kernel::crt_film_reflectance_lane(
                static_cast<float>(std::min(1.0, static_cast<double>(i) / kCells)),
                static_cast<float>(film.film_index / before), static_cast<float>(film.film_rounds * before),
                static_cast<float>(inside ? 1 / film.index : film.index), 0.0f));
    }
    double operator()(double cosine) const {
        const double x = std::min(cosine, 1.0) * kCells;
        const auto i = static_cast<std::size_t>(x);
        return values_[i] + (x - static_cast<double>(i)) * (values_[i + 1] - values_[i]);
    }

private:
    static constexpr std::size_t kCells = 2048;
    std::vector<double> values_;
};

/// As of compensation.h; `reflectance` is that of the interface, `open` the share of light towards a
/// direction, turned to this side of the surface, that nothing is in the way of. `kFineness`: of the rule.
template <std::size_t kFineness, class F, class G>
double microfacetLoss(const Vec3d& w, double eta, const Widths& alpha, const F& reflectance, const G& open) {
    const auto lost = [&](double cos_m, const Vec3d& m) {
        const double mirrored = 1 - open(m * (2 * cos_m) - w);
        if (eta == 0) return mirrored;
        const double refraction = (eta - 1) * (eta + 1) + cos_m * cos_m;
        if (!(refraction > 0)) return mirrored;
        const double reflected = reflectance(cos_m);
        const Vec3d bent = w - m * (cos_m - std::sqrt(refraction));
        return reflected * mirrored +
               (1 - reflected) * (1 - open({bent[0] / eta, bent[1] / eta, bent[2] / eta}));
    };
    return eta > 0 && eta < 1 ? meanOverVisibleNormals<kFineness, kFineness>(w, alpha, lost)
                              : meanOverVisibleNormals<32, kFineness>(w, alpha, lost);
}

/// What one row is made by.
struct Row {
    double index, alpha;
    std::function<double(double)> reflectance;
    double narrowing = 0, azimuth = 0;  ///< As of crt_azimuth.

    double loss(double cosine) const {
        if (narrowing == 0)
            return microfacetLoss<128>(atCosine(cosine), index, {alpha, alpha}, reflectance,
                                       [&](const Vec3d& w) { return unshadowed(cosine, w[2], alpha); });
        const Vec3d w_o = atAzimuth(azimuth, cosine, narrowing);
        const Widths widths{alpha, narrowing * alpha};
        return microfacetLoss<64>(w_o, index, widths, reflectance,
                                  [&](const Vec3d& w) { return unshadowed(w_o, w, widths); });
    }
};

Compensations::Table makeTable(const TableKey& key, const Across& across) {
    Compensations::Table table;
    kernel::CrtLoss& record = table.record;
    record.sides = key.refracts ? 2 : 1;
    record.by_azimuth = key.narrowing > 0;
    record.roughnesses = record.by_azimuth ? CRT_LOSS_AZIMUTHS : key.textured ? kRoughnesses : 1;
    record.indices = static_cast<std::uint32_t>(across.interfaces.size());
    record.first_index = static_cast<float>(across.first);
    record.index_scale = static_cast<float>(1 / across.step);

    std::vector<Row> rows;
    for (const Interface& i : across.interfaces)
        for (std::uint32_t r = 0; r < record.roughnesses; ++r)
            for (std::uint32_t side = 0; side < record.sides; ++side) {
                const double roughness =
                    key.textured ? static_cast<double>(r) / (record.roughnesses - 1) : key.roughness;
                // Narrower ones are smooth; between them and the first row the kernel needs one more.
                const double alpha = std::max<double>(roughness * roughness, CRT_ALPHA_MIN);
                const double index = side == 0 ? i.index : 1 / i.index;
                if (i.film_rounds > 0)
                    rows.push_back({index, alpha, FilmReflectance(i, side != 0)});
                else
                    rows.push_back(
                        {index, alpha, [index](double c) { return dielectricReflectance(c, index); }});
                if (!record.by_azimuth) continue;
                rows.back().narrowing = key.narrowing;
                rows.back().azimuth = static_cast<double>(r) / (CRT_LOSS_AZIMUTHS - 1.0);
            }
    table.rows.assign(rows.size() * kStride, 0);
    parallelFor(rows.size() * (kLossSteps + 1), 8, [&](std::size_t first, std::size_t end) {
        for (std::size_t n = first; n < end; ++n) {
            const Row& row = rows[n / (kLossSteps + 1)];
            const double t = static_cast<double>(n % (kLossSteps + 1)) / kLossSteps;
            table.rows[n / (kLossSteps + 1) * kStride + n % (kLossSteps + 1)] =
                static_cast<float>(row.loss(std::max(t * t, 1e-6)));
        }
    });
    for (std::size_t i = 0; i < rows.size(); ++i) {
        float* const values = table.rows.data() + i * kStride;
        values[kLossSteps + 1] = values[kLossSteps];
        integrate(values);
        if (key.refracts)
            values[kLossSteps + 3] = static_cast<float>(1 - cosineMean(1024, rows[i].reflectance));
    }
    if (record.by_azimuth) {
        const std::size_t step = record.sides * kStride;
        for (std::size_t i = 0; i < record.indices; ++i)
            for (std::size_t side = 0; side < record.sides; ++side)
                integrateAzimuths(table.rows.data() + i * CRT_LOSS_AZIMUTHS * step + side * kStride, step,
                                  key.narrowing);
    }
    return table;
}

Spectrum meanReflectance(const Material& metal) {
    Spectrum mean;
    const auto at = [&](std::size_t i) {
        return cosineMean(64, [&](double c) { return conductorReflectance(c, metal.eta[i], metal.k[i]); });
    };
    if (metal.eta.isConstant() && metal.k.isConstant()) return constantSpectrum(at(0));
    for (std::size_t i = 0; i < kSpectrumSize; ++i) mean[i] = at(i);
    return mean;
}

}  // namespace

double microfacetLoss(double cosine, double eta, double alpha) {
    return Row{eta, alpha, [eta](double c) { return dielectricReflectance(c, eta); }}.loss(cosine);
}

Anisotropy anisotropyOf(const Material& material) {
    Anisotropy a;
    const double width = material.roughness * material.roughness, across = 1 - material.anisotropy;
    const bool rough =
        material.type == MaterialType::RoughConductor || material.type == MaterialType::RoughDielectric;
    if (!rough || !(material.anisotropy > 0) || isSmooth(material.roughness)) return a;
    a.widening = std::sqrt(2 / (1 + across * across));
    double least = CRT_ALPHA_MIN;
    if (material.type == MaterialType::RoughDielectric) {
        const double bend = std::min(std::abs(material.eta.min() - 1), std::abs(material.eta.max() - 1));
        if (bend > 0) least = std::max(least, static_cast<double>(CRT_BEND_MIN) / bend);
    }
    a.narrowing = std::min(1.0, std::max({across, kLeastNarrowing, least / (width * a.widening)}));
    return a;
}

Compensations compensationsOf(const std::vector<const Material*>& materials) {
    Compensations all;
    std::map<TableKey, std::uint32_t> known;
    for (const Material* material : materials) {
        if (!material || (material->type != MaterialType::RoughConductor &&
                          material->type != MaterialType::RoughDielectric))
            continue;
        if (material->type == MaterialType::RoughConductor && !hasThinFilm(*material) && !material->by_color)
            all.mean_reflectance[material] = meanReflectance(*material);
        if (material->roughness_texture == kNoTexture && isSmooth(material->roughness)) continue;
        const TableKey key = tableKeyOf(*material);
        if (key.refracts && hasThinFilm(*material)) {
            all.table_of[material] = static_cast<std::uint32_t>(all.tables.size());
            all.tables.push_back(makeTable(key, acrossWavelengths(*material)));
            continue;
        }
        const auto [found, fresh] = known.try_emplace(key, static_cast<std::uint32_t>(all.tables.size()));
        if (fresh) all.tables.push_back(makeTable(key, key.refracts ? acrossIndices(key) : Across{}));
        all.table_of[material] = found->second;
    }
    return all;
}

kernel::CrtSpan appendLosses(BlobWriter& blob, const Compensations& compensations) {
    std::vector<kernel::CrtLoss> records;
    for (const Compensations::Table& table : compensations.tables) {
        records.push_back(table.record);
        records.back().rows = blob.append(table.rows);
    }
    return blob.append(records);
}

}  // namespace crt
