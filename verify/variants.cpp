#include "verify/variants.h"

#include "kernel/schedule/pixel.h"
#include "verify/shapes.h"

#include <memory>
#include <span>
#include <utility>

namespace crt::verify {
namespace {

/// n(λ) of a strongly dispersive flint, roughly SF10: Cauchy's two terms.
Spectrum flint() {
    Spectrum s;
    for (std::size_t i = 0; i < kSpectrumSize; ++i) {
        const double um = (360 + static_cast<double>(i)) * 1e-3;
        s[i] = 1.6995 + 0.01 / (um * um);
    }
    return s;
}

Scene richRoom(int resolution) {
    Scene scene = litRoom(resolution, 1);
    scene.integrator.roulette = true;
    scene.integrator.max_depth = 10;
    scene.environment = Environment{constantSpectrum(0.1)};
    addObject(scene, boxMesh({0.0625, 0.5, 0.125}, {0.25, 0.75, 0.375}), glass(1.5));
    Mesh gem = icosphere(1, 0.15, {0.65, 0.65, 0.3});
    for (const Vec3d& p : gem.positions) gem.normals.push_back(unit(p - Vec3d{0.65, 0.65, 0.3}));
    gem.normal_index = gem.triangles;
    Material dispersive = glass(1.7);
    dispersive.eta = flint();
    addObject(scene, std::move(gem), std::move(dispersive));
    Material metal;
    metal.name = "metal";
    metal.type = MaterialType::Conductor;
    metal.eta = constantSpectrum(0.2);
    metal.k = constantSpectrum(3.5);
    addObject(scene, boxMesh({0.75, 0.03125, 0.25}, {0.9375, 0.1875, 0.4375}), std::move(metal));
    return scene;
}

}  // namespace

std::vector<Variant> variants(int resolution) {
    std::vector<Variant> all;
    const auto add = [&](const char* name, auto change) {
        Scene scene = richRoom(resolution);
        change(scene);
        const std::uint64_t needs = compileScene(scene, kAllAovs).header().features;
        all.push_back({name, std::move(scene), needs});
    };
    add("Sobol", [](Scene& s) { s.sampler.type = SamplerType::Sobol; });
    add("tree, lens, gaussian filter, rough metal", [](Scene& s) {
        s.camera.aperture_radius = 0.03125;
        s.camera.focus_distance = 1.5;
        s.film.filter = PixelFilter::Gaussian;
        s.film.filter_radius = 1.5;
        for (Material& material : s.materials)
            if (material.type == MaterialType::Conductor) {
                material.type = MaterialType::RoughConductor;
                material.roughness = 0.3;
            }
    });
    add("rough dispersive gem, absorbing; pane; plastic", [](Scene& s) {
        for (Material& material : s.materials)
            if (material.type == MaterialType::Dielectric) {
                const bool gem = !material.eta.isConstant();
                material.type = gem ? MaterialType::RoughDielectric : MaterialType::ThinDielectric;
                material.roughness = gem ? 0.4 : 0;
                if (gem) material.absorption = flint();
            } else if (material.type == MaterialType::Conductor) {
                material.type = MaterialType::Plastic;
                material.reflectance = constantSpectrum(0.6);
                material.eta = constantSpectrum(1.5);
                material.roughness = 0.3;
            }
    });
    add("films on metal, glass and panes", [](Scene& s) {
        for (Material& material : s.materials) {
            if (material.type == MaterialType::Dielectric && material.eta.isConstant())
                material.type = MaterialType::ThinDielectric;
            material.film_index = constantSpectrum(1.4);
            material.film_thickness_nm = 450;
        }
    });
    add("brushed metal and glass", [](Scene& s) {
        for (Material& material : s.materials) {
            if (material.type == MaterialType::Conductor) material.type = MaterialType::RoughConductor;
            if (material.type == MaterialType::Dielectric) material.type = MaterialType::RoughDielectric;
            material.roughness = 0.4;
            material.anisotropy = 0.8;
            material.anisotropy_rotation_deg = 20;
        }
    });
    add("instances", [](Scene& s) {
        for (Object& object : s.objects) object.sharing = Sharing::Always;
    });
    add("shapes", [](Scene& s) {
        for (const Quadric& shape : {Quadric{QuadricType::Sphere, 0.125, -0.125, 0.125},
                                     Quadric{QuadricType::Sphere, 0.1875, -0.0625, 0.125},
                                     Quadric{QuadricType::Cylinder, 0.0625, -0.125, 0.1875},
                                     Quadric{QuadricType::Disk, 0.125, 0, 0}}) {
            const double along = 0.25 * static_cast<double>(s.objects.size() % 4);
            const std::size_t added = addObject(s, {}, diffuse(0.5));
            s.objects[added].shape = shape;
            s.objects[added].transforms = {
                {1, 0, 0, 0.125 + along, 0, 1, 0, 0.375, 0, 0, 1, 0.625, 0, 0, 0, 1}};
        }
    });
    add("fuzz", [](Scene& s) {
        for (Material& material : s.materials) {
            material.fuzz = 0.5;
            material.fuzz_color = constantSpectrum(0.9);
            material.fuzz_roughness = 0.4;
        }
    });
    add("coats, tinted", [](Scene& s) {
        for (Material& material : s.materials)
            if (!material.transmits())
                material.clearcoat = Clearcoat{.ior = 1.5, .roughness = 0.3, .depth = constantSpectrum(0.2)};
    });
    add("thin sheets", [](Scene& s) {
        for (Material& material : s.materials)
            if (material.type == MaterialType::Diffuse) {
                material.type = MaterialType::Plastic;
                material.eta = constantSpectrum(1.4);
                material.roughness = 0.3;
                material.transmittance = constantSpectrum(0.4);
            }
    });
    add("lamps that show an image", [](Scene& s) {
        auto image = std::make_shared<TextureImage>();
        image->file = "picture";
        image->width = image->height = 5;
        image->decode = [](std::span<std::uint16_t> words) {
            for (std::size_t i = 0; i < words.size(); ++i)
                words[i] = static_cast<std::uint16_t>(32768 + 256 * (i * 7 % 11));
        };
        Texture picture;
        picture.image = std::move(image);
        for (Emission& emission : s.emissions) {
            picture.factor = TextureValue{emission.radiance, kNoTexture};
            emission.texture = static_cast<TextureIndex>(s.textures.size());
            s.textures.push_back(picture);
        }
        for (Mesh& mesh : s.meshes) {
            for (const Vec3d& p : mesh.positions) mesh.uvs.push_back({p[0] + 0.5 * p[1], p[2] - 0.5 * p[1]});
            mesh.uv_index = mesh.triangles;
        }
    });
    add("gloss and coats of varying roughness, tints", [](Scene& s) {
        Texture checker;
        checker.kind = Texture::Kind::Checker;
        checker.values = {TextureValue{constantSpectrum(0.2), kNoTexture},
                          TextureValue{constantSpectrum(0.6), kNoTexture}};
        s.textures = {checker};
        for (Material& material : s.materials) {
            material.tint = constantSpectrum(0.8);
            if (material.type == MaterialType::Diffuse) {
                material.type = MaterialType::Plastic;
                material.eta = constantSpectrum(1.4);
                material.roughness_texture = 0;
            } else if (material.type == MaterialType::Conductor) {
                material.clearcoat =
                    Clearcoat{.ior = 1.5, .roughness_texture = 0, .depth = constantSpectrum(0.1)};
            }
        }
    });
    add("rough diffuse bases", [](Scene& s) {
        for (Material& material : s.materials)
            if (material.type == MaterialType::Diffuse) {
                material.type = MaterialType::Plastic;
                material.eta = constantSpectrum(1.4);
                material.diffuse_roughness = 0.7;
                material.by_color = true;
            }
    });
    add("metals and gloss by their colours", [](Scene& s) {
        for (Material& material : s.materials)
            if (material.type == MaterialType::Conductor || material.type == MaterialType::Dielectric) {
                const bool metal = material.type == MaterialType::Conductor;
                material.type = metal ? MaterialType::RoughConductor : MaterialType::Plastic;
                material.reflectance = constantSpectrum(0.7);
                material.edge_tint = constantSpectrum(0.4);
                material.eta = constantSpectrum(1.5);
                material.weight = 0.9;
                material.roughness = 0.4;
                material.by_color = true;
            }
    });
    add("boxes of objects, xorshift, Blackman-Harris filter, no light sampling", [](Scene& s) {
        s.integrator.accelerator = Accelerator::Aabb;
        s.integrator.nee = false;
        s.sampler.type = SamplerType::XorShift;
        s.sampler.seed = ~std::uint64_t{0};
        s.film.filter = PixelFilter::BlackmanHarris;
        s.film.filter_radius = 1.5;
    });
    add("no tree, environment sampled as a light", [](Scene& s) {
        s.objects.erase(s.objects.begin() + 5);  // the gem: few enough triangles are left
        s.integrator.accelerator = Accelerator::None;
        s.environment->light_sampling = true;
    });
    add("lights without a surface", [](Scene& s) {
        PointLight light;
        light.spectrum = constantSpectrum(1);
        light.position = {0.5, 0.5, 0.125};
        light.strength = 0.25;
        light.direction = unit({0.25, -0.5, 1});
        for (const PointLightType type : {PointLightType::Point, PointLightType::Spot,
                                          PointLightType::Directional, PointLightType::Sun}) {
            light.type = type;
            s.point_lights.push_back(light);
        }
        PointLight& sun = s.point_lights.back();
        sun.angular_diameter_deg = 10;
        sun.strength = 8;
    });
    add("IES lamps and beams", [](Scene& s) {
        PointLight light;
        light.spectrum = constantSpectrum(1);
        light.position = {0.5, 0.5, 0.125};
        light.direction = {0, 0, 1};
        light.strength = 0.5;
        light.type = PointLightType::Ies;
        light.ies = std::make_shared<IesProfile>(
            IesProfile{{0, 45, 90}, {0, 90, 180, 360}, {2, 1, 0, 2, 2, 0, 2, 0, 0, 2, 1, 0}});
        s.point_lights.push_back(light);
        light.type = PointLightType::Beam;
        light.radius = 0.125;
        light.strength = 2;
        s.point_lights.push_back(light);
        light.radius = 0;
        light.width = light.height = 0.25;
        light.position = {0.25, 0.75, 0.125};
        s.point_lights.push_back(light);
    });
    add("textures", [](Scene& s) {
        Texture checker;
        checker.kind = Texture::Kind::Checker;
        checker.transform = {5, 0, 0.25, 0, 5, 0.25};
        checker.values = {TextureValue{flint(), kNoTexture},
                          TextureValue{constantSpectrum(0.25), kNoTexture}};
        for (double& value : checker.values[0].spectrum.values) value *= 0.5;
        s.textures.push_back(std::move(checker));
        for (Material& material : s.materials) material.reflectance_texture = 0;
        for (Mesh& mesh : s.meshes) {
            for (const Vec3d& p : mesh.positions) mesh.uvs.push_back({p[0] + 0.5 * p[1], p[2] - 0.5 * p[1]});
            mesh.uv_index = mesh.triangles;
        }
    });
    add("mixes and holes", [](Scene& s) {
        Material mix;
        mix.name = "mix";
        mix.type = MaterialType::Mix;
        mix.parts = {0, 1};
        mix.amount = 0.375;
        mix.opacity = 0.75;
        s.objects[0].material = static_cast<std::int32_t>(s.materials.size());
        s.materials.push_back(std::move(mix));
    });
    add("normal maps", [](Scene& s) {
        auto image = std::make_shared<TextureImage>();
        image->file = "slopes";
        image->width = image->height = 4;
        image->kind = TexelKind::Normals;
        image->decode = [](std::span<std::uint16_t> words) {
            for (std::size_t i = 0; i < words.size(); ++i)
                words[i] = static_cast<std::uint16_t>(i % 3 == 2 ? 60000 : 65535 * (i * 7 % 11) / 11);
        };
        Texture map;
        map.image = std::move(image);
        s.textures.push_back(std::move(map));
        for (Material& material : s.materials) material.normal_texture = 0;
        for (Mesh& mesh : s.meshes) {
            for (const Vec3d& p : mesh.positions) mesh.uvs.push_back({p[0] + 0.5 * p[1], p[2] - 0.5 * p[1]});
            mesh.uv_index = mesh.triangles;
        }
    });
    add("a sky", [](Scene& s) {
        CieSky sky;
        sky.towards_sun = unit({0.25, 1, -0.5});
        sky.rows = 32;
        s.environment->sky = sky;
        s.environment->light_sampling = true;
    });
    add("many lights", [](Scene& s) {
        for (int i = 0; i < 24; ++i) {
            const double x = 0.125 + 0.125 * (i % 6), z = 0.125 + 0.1875 * (i / 6);
            Mesh mesh;
            addTriangle(mesh, {x, 0.75, z}, {x + 0.03125, 0.75, z},
                        {x, 0.75 + 0.015625 * (i % 3), z + 0.0625});
            addObject(s, std::move(mesh), diffuse(0.5), 1.0 + i, i % 2 == 0);
        }
    });
    add("a spectral film", [](Scene& s) {
        s.film.spectral = {{380, 780, 16}, {{"flint", flint()}, {"flat", constantSpectrum(1)}}, false};
    });
    add("splats on random pixels", [](Scene& s) { s.integrator.type = IntegratorType::SplatTest; });
    add("view of the normals", [](Scene& s) { s.integrator.type = IntegratorType::Normals; });
    add("view of the boxes", [](Scene& s) { s.integrator.type = IntegratorType::Aabb; });
    return all;
}

void forEachVariant(Context& context, int resolution, void (*ask)(Context&, const Variant&),
                    std::size_t step) {
    const std::vector<Variant> all = variants(resolution);
    for (std::size_t number = 0; number < all.size(); number += step) {
        const Variant& v = all[number];
        if ((v.needs & ~context.backend().table->features) == 0)
            ask(context, v);
        else
            context.notApplicable(v.name, "the backend was built without " +
                                              featureNames(v.needs & ~context.backend().table->features));
    }
}

Film portableFilm(const Scene& scene, const Render& how) {
    const CompiledScene compiled = compileScene(scene, how.aovs);
    Film film(filmShapeOf(compiled));
    film.samples.add({how.first_sample, how.first_sample + how.samples});
    kernel::CrtContext context{};
    context.blob = compiled.data();
    context.scene = reinterpret_cast<const kernel::CrtScene*>(compiled.data());
    for (std::uint32_t y = 0; y < compiled.header().height; ++y)
        for (std::uint32_t x = 0; x < compiled.header().width; ++x) {
            kernel::CrtRayCount rays{};
            kernel::crt_render_pixel(&context, x, y, how.first_sample,
                                     static_cast<std::uint32_t>(how.samples), film.sums.data(),
                                     reinterpret_cast<kernel::u64*>(film.counts.data()),
                                     film.primitives.empty() ? nullptr : film.primitives.data(),
                                     film.splats.empty() ? nullptr : film.splats.data(), &rays);
        }
    return film;
}

}  // namespace crt::verify
