// Mesh reader tests with plumbline-mesh: valid files of every format, and invalid ones.
#include "app/cell/scene/mesh_file.h"

#include <fmt/format.h>
#include <sys/stat.h>

#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>
#include <map>

#include "tests/app/cell/scene/shapes.h"
#include "tests/app/temporary_folder.h"

using namespace plumbline;

using namespace plumbline::cell;
using test::Cuboid;
using test::MeshFileText;

namespace {

struct MeshFolder {
  test::TemporaryFolder folder;
  std::string Write(const std::string& name, const std::string& content) const {
    const std::string path = folder.path() + "/" + name;
    std::ofstream(path, std::ios::binary) << content;
    return path;
  }
  Result<MeshFile> Read(const std::string& name, const std::string& content, double unit_m = 1,
                        const MeshLimits& limits = {}) const {
    return ReadMeshFile(Write(name, content), unit_m, limits, PLUMBLINE_MESH);
  }
  std::string Why(const std::string& name, const std::string& content,
                  const MeshLimits& limits = {}) const {
    const auto read = Read(name, content, 1, limits);
    return read ? "read" : read.error();
  }
};

std::string Vrml(const std::string& scene) {
  return "#VRML V2.0 utf8\n" + scene + "\n";
}

const std::string kBox = "Shape { geometry Box { size 2 2 2 } }";

}  // namespace

TEST_CASE("a sphere in millimetres, in every format, is the same mesh") {
  const MeshFolder files;
  const scene::TriangleMesh sphere = test::Sphere(150, 12, 24);
  std::map<std::string, std::string> texts = {{"a.stl", test::StlText(sphere)},
                                              {"b.ply", test::BinaryPlyText(sphere)},
                                              {"C.STL", MeshFileText(sphere, MeshFormat::kStl)}};
  for (const auto format : {MeshFormat::kVrml, MeshFormat::kStl, MeshFormat::kObj, MeshFormat::kPly,
                            MeshFormat::kGltf, MeshFormat::kGlb}) {
    texts[fmt::format("sphere.{}", WordOf(format))] = MeshFileText(sphere, format);
  }
  for (const auto& [name, text] : texts) {
    const auto read = files.Read(name, text, 1e-3);
    INFO(name << ": " << (read ? "" : read.error()));
    REQUIRE(read);
    const scene::MeshFacts& facts = read->checked.facts;
    CHECK(facts.vertices == 2 + 11 * 24);
    CHECK(facts.triangles == sphere.triangles.size());
    CHECK(facts.facing() == scene::Facing::kOutwards);
    CHECK(read->outside.empty());
    CHECK(read->bytes == text.size());
    for (const Vec3f& p : read->checked.mesh.vertices_O)
      CHECK(p.norm() == Approx(0.15).epsilon(1e-5));
  }
}

TEST_CASE("VRML97: transforms, mirrors, DEF and USE, the ready shapes, clockwise faces") {
  const MeshFolder files;
  const auto volume = [&files](const std::string& scene) {
    const auto read = files.Read("scene.wrl", Vrml(scene));
    INFO(scene << (read ? "" : read.error()));
    REQUIRE(read);
    CHECK(read->checked.facts.closed());
    return read->checked.facts.volume_m3;
  };
  CHECK(volume(kBox) == Approx(8));
  CHECK(volume("Transform { scale -1 2 1 translation 9 0 0 children " + kBox + " }") == Approx(16));
  CHECK(volume("DEF A " + kBox + " Transform { translation 5 0 0 children USE A }") == Approx(16));
  CHECK(volume("Shape { geometry Cylinder { radius 1 height 2 } }") == Approx(6.283).epsilon(0.05));
  CHECK(volume("Shape { geometry Extrusion { } }") > 0);
  CHECK(volume("PROTO P [ field SFVec3f s 1 1 1 ] { Shape { geometry Box { size IS s } } } P { s 2 "
               "2 2 }") == Approx(8));
  std::string turned = MeshFileText(Cuboid({2, 2, 2}), MeshFormat::kVrml);
  turned.replace(turned.find("coord "), 6, "ccw FALSE coord ");
  const auto read = files.Read("turned.wrl", turned);
  REQUIRE(read);
  CHECK(read->checked.facts.facing() == scene::Facing::kInwards);
}

TEST_CASE("a shape far from its origin is rounded to single precision, which is reported") {
  const MeshFolder files;
  const std::string box = "children Shape { geometry Box { size 100 60 40 } }";
  struct Case {
    std::string scene, words;
  };
  for (const auto& [scene, words] : {
           Case{"Transform { translation 4700123.4 5300456.7 812.3 " + box + " }",
                "reach 5.3e+06 mm from the origin, where single precision has steps of 0.5 mm"},
           Case{"Transform { translation -4700123 0 0 children Transform { translation 4700123 0 "
                "0 " +
                    box + " } }",
                "steps of 0.5 mm"},  // it ends at the origin, but has been rounded
           Case{"Transform { translation 100000 0 0 " + box + " }", ""},
           // In single precision at 4700 m, and then reduced to millimetres.
           Case{"Transform { scale 0.001 0.001 0.001 children Transform { "
                "translation 4700123 0 0 " +
                    box + " } }",
                ""},
           Case{"Transform { scale 1000 1000 1000 children Transform { translation 4700 0 0 " +
                    box + " } }",
                "steps of 0.5 mm"},
       }) {
    CAPTURE(scene);
    const auto read = files.Read("a.wrl", Vrml(scene), 1e-3);
    REQUIRE(read);
    CHECK_THAT(PrecisionProblem(*read), Catch::Contains(words));
    CHECK(PrecisionProblem(*read).empty() == words.empty());
  }
  const auto reduced = files.Read("part.wrl",
                                  Vrml("Transform { scale .001 .001 .001 children Shape { geometry "
                                       "Box { size 5000 60 40 } } }"),
                                  1);
  REQUIRE(reduced);
  CHECK(PrecisionProblem(*reduced).empty());
  CHECK(1e3 * reduced->precision_m == Approx(0.00024).epsilon(0.01));
  scene::TriangleMesh far = Cuboid({100, 60, 40});
  for (Vec3f& p : far.vertices_O) p.x() += 4700123.5F;
  for (const auto format : {MeshFormat::kStl, MeshFormat::kObj, MeshFormat::kPly}) {
    const auto read =
        files.Read(fmt::format("far.{}", WordOf(format)), MeshFileText(far, format), 1e-3);
    REQUIRE(read);
    CHECK_THAT(PrecisionProblem(*read), Catch::Contains("export it near the origin"));
  }
}

TEST_CASE("references to other files are reported and never opened") {
  const MeshFolder files;
  const std::string names = files.Why(
      "a.wrl", Vrml("DEF InlineFour Shape { appearance Appearance { texture ImageTexture { url "
                    "\"wood.png\" } } geometry Box { } }\n# Inline { url \"comment.wrl\" }\n"
                    "Inline { url \"part.wrl\" }"));
  CHECK_THAT(names, Catch::Contains("never opened: Inline \"part.wrl\"; export"));
  files.Write("other.wrl", Vrml(kBox));
  const std::string other = files.folder.path() + "/other.wrl";
  for (const std::string& url :
       {other, std::string("http://192.0.2.1/part.wrl"), "file://" + other}) {
    const std::string why = files.Why("a.wrl", Vrml("Inline { url \"" + url + "\" } " + kBox));
    CHECK_THAT(why, Catch::Contains("never opened: Inline \"" + url));
  }
  CHECK(files.Why("a.wrl", Vrml("EXTERNPROTO X [ ] \"" + other + "\" X { }")) != "read");
  CHECK_THAT(files.Why("a.wrl", Vrml("EXTERNPROTO Lib [ ] \"library.wrl#Lib\"\n"
                                     "Inline { url \"part_b.wrl\" }\n" +
                                     kBox)),
             Catch::Contains("EXTERNPROTO \"library.wrl#Lib\", Inline \"part_b.wrl\""));
  const auto textured = files.Read(
      "a.wrl",
      Vrml("Shape { appearance Appearance { texture ImageTexture { url \"wood.png\" } } geometry "
           "Box { } }"));
  REQUIRE(textured);
  CHECK(textured->outside == std::vector<std::string>{"wood.png"});
  const auto material = files.Read("a.obj", "mtllib paint.mtl\nusemtl red\n" +
                                                MeshFileText(Cuboid({1, 1, 1}), MeshFormat::kObj));
  REQUIRE(material);
  CHECK(material->outside == std::vector<std::string>{"paint.mtl"});
  std::string gltf = MeshFileText(Cuboid({1, 1, 1}), MeshFormat::kGltf);
  const auto uri = gltf.find("data:"), end = gltf.find('"', uri);
  gltf.replace(uri, end - uri, "../geometry.bin");
  CHECK_THAT(files.Why("a.gltf", gltf), Catch::Contains("never opened (../geometry.bin)"));
}

TEST_CASE("malicious VRML97 is refused: cycles, doubling, depth, indices, grids") {
  const MeshFolder files;
  CHECK_THAT(files.Why("a.wrl", Vrml("DEF A Group { children [ USE A, " + kBox + " ] }")),
             Catch::Contains("USE themselves"));
  for (const std::string& seed : {kBox, std::string("Group { }")}) {
    std::string text = "DEF L0 Group { children " + seed + " }\n";
    for (int i = 1; i < 50; ++i) {
      text += fmt::format("DEF L{} Group {{ children [ USE L{} USE L{} ] }}\n", i, i - 1, i - 1);
    }
    CHECK_THAT(files.Why("a.wrl", Vrml(text)), Catch::Contains("limit is 2000000") ||
                                                   Catch::Contains("after expanding DEF and USE"));
  }
  std::string deep;
  for (int i = 0; i < 100'000; ++i) deep += "Group { children [ ";
  CHECK(files.Why("a.wrl", Vrml(deep)) != "read");
  CHECK(files.Why("a.wrl", Vrml("PROTO P [ ] { Group { children [ P { } P { } ] } } P { }")) !=
        "read");
  CHECK_THAT(
      files.Why("a.wrl", Vrml("Shape { geometry IndexedFaceSet { coord Coordinate { point [ 0 "
                              "0 0, 1 0 0, 0 1 0 ] } coordIndex [ 0 1 2 -1 0 1 7 -1 ] } }")),
      Catch::Contains("with 3 points has 1 indices"));
  CHECK(files.Why("a.wrl", Vrml("Shape { geometry ElevationGrid { xDimension 2000000000 zDimension "
                                "2000000000 height [ 0 0 0 0 ] } }")) != "read");
  CHECK_THAT(files.Why("a.wrl", "#VRML V1.0 ascii\nCube { }\n"), Catch::Contains("VRML 1.0"));
  CHECK_THAT(files.Why("a.wrl", "#Inventor V2.1 ascii\nSeparator { }\n"),
             Catch::Contains("it is Open Inventor (Coin, SGI): export it as VRML 2.0"));
  CHECK_THAT(files.Why("a.wrl", "#VRML V2.0 utf8\nShape { geometry IndexedFaceSet { coord"),
             Catch::Contains("not readable as VRML97"));
}

TEST_CASE("malicious files for Assimp are refused") {
  const MeshFolder files;
  const std::string vertices = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
  CHECK_THAT(files.Why("a.obj", vertices + "f 1 2 9\n"), Catch::Contains("out of range"));
  CHECK_THAT(files.Why("a.obj", "v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n"),
             Catch::Contains("not a finite number"));
  CHECK(files.Why("a.obj", "v 0 0 0\nv 1e99 0 0\nv 0 1 0\nf 1 2 3\n") != "read");
  CHECK(files.Why("a.obj", vertices) != "read");
  CHECK(files.Why("a.gltf", R"({"asset":{"version":"2.0"},"a":)" + std::string(1 << 20, '[')) !=
        "read");
  std::string gltf = MeshFileText(Cuboid({1, 1, 1}), MeshFormat::kGltf);
  const std::string node = R"("nodes":[{"mesh":0}])";
  gltf.replace(gltf.find(node), node.size(), R"("nodes":[{"mesh":0,"children":[0]}])");
  CHECK(files.Why("a.gltf", gltf) != "read");
  CHECK(files.Why("a.stl", "no mesh at all") != "read");
  CHECK(files.Why("a.ply",
                  "ply\nformat ascii 1.0\nelement vertex 4000000000\nproperty float "
                  "x\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n") !=
        "read");
}

TEST_CASE("a truncated file is refused, wherever it was cut") {
  const MeshFolder files;
  const scene::TriangleMesh cuboid = Cuboid({1, 2, 3});
  const std::map<std::string, std::string> texts = {
      {"a.wrl", MeshFileText(cuboid, MeshFormat::kVrml)},
      {"a.stl", MeshFileText(cuboid, MeshFormat::kStl)},
      {"b.stl", test::StlText(cuboid)},
      {"a.ply", MeshFileText(cuboid, MeshFormat::kPly)},
      {"b.ply", test::BinaryPlyText(cuboid)},
      {"a.gltf", MeshFileText(cuboid, MeshFormat::kGltf)},
      {"a.glb", MeshFileText(cuboid, MeshFormat::kGlb)}};
  for (const auto& [name, text] : texts) {
    REQUIRE(files.Read(name, text));
    for (const double share : {0.01, 0.3, 0.6, 0.9, 0.97}) {
      const auto size = static_cast<std::size_t>(share * static_cast<double>(text.size()));
      INFO(name << " to " << share);
      CHECK(files.Why(name, text.substr(0, size)) != "read");
    }
  }
}

TEST_CASE("ten million triangles are refused with the limit, in every format") {
  const MeshFolder files;
  // Sparse file: 500 MB of zeros after the header.
  const std::string stl =
      files.Write("a.stl", std::string(80, ' ') + std::string("\x80\x96\x98\0", 4));
  std::filesystem::resize_file(stl, 84 + 50ULL * 10'000'000);
  const auto read = ReadMeshFile(stl, 1, {}, PLUMBLINE_MESH);
  REQUIRE_FALSE(read);
  CHECK_THAT(read.error(), Catch::Contains("at least 10000000 triangles; the limit is 2000000"));
  std::filesystem::resize_file(stl, 600ULL << 20);
  CHECK_THAT(ReadMeshFile(stl, 1, {}, PLUMBLINE_MESH).error(),
             Catch::Contains("600 MiB; the limit is 512 MiB"));

  const scene::TriangleMesh sphere = test::Sphere(1, 60, 60);
  const MeshLimits few{.triangles = 5000};
  for (const auto format : {MeshFormat::kVrml, MeshFormat::kStl, MeshFormat::kObj, MeshFormat::kPly,
                            MeshFormat::kGltf, MeshFormat::kGlb}) {
    CHECK_THAT(files.Why(fmt::format("a.{}", WordOf(format)), MeshFileText(sphere, format), few),
               Catch::Contains("the limit is 5000"));
  }
}

TEST_CASE("memory and time limits end the process with an error that names the limit") {
  const MeshFolder files;
#ifndef PLUMBLINE_SANITIZED
  const std::string large = MeshFileText(test::Sphere(1, 400, 400), MeshFormat::kObj);
  CHECK_THAT(files.Why("a.obj", large, {.memory_bytes = 64 << 20}), Catch::Contains("64 MiB"));
#endif
  std::string slow =
      "Shape { geometry IndexedFaceSet { coord Coordinate { point [ 0 0 0, 1 0 0, 0 1 "
      "0 ] } coordIndex [";
  for (int i = 0; i < 3'000'000; ++i) slow += "0 1 2 -1\n";
  CHECK_THAT(files.Why("a.wrl", Vrml(slow + "] } }"), {.triangles = 20'000'000, .cpu_s = 1}),
             Catch::Contains("not read within 1 s of CPU time"));
  const std::string program = files.Write("sleeper", "#!/bin/sh\nexec sleep 1000\n");
  chmod(program.c_str(), 0755);
  const std::string good = files.Write("a.stl", MeshFileText(Cuboid({1, 1, 1}), MeshFormat::kStl));
  const auto late = ReadMeshFile(good, 1, {.wall_s = 0.2}, program);
  CHECK_THAT(late.error(), Catch::Contains("not read within 0.2 s"));
  files.Write("sleeper", "#!/bin/sh\nexec 1>&-\nexec sleep 1000\n");  // closes its output and stays
  CHECK_FALSE(ReadMeshFile(good, 1, {}, program));
  files.Write("sleeper", "#!/bin/sh\nexec yes\n");
  CHECK_THAT(ReadMeshFile(good, 1, {.triangles = 100}, program).error(),
             Catch::Contains("more data than allowed"));
  CHECK_THAT(ReadMeshFile(good, 1, {}, "/bin/true").error(), Catch::Contains("invalid result"));
  CHECK_THAT(ReadMeshFile(good, 1, {}, "/nonexistent").error(),
             Catch::Contains("cannot be started"));
}

TEST_CASE("an unreadable file is refused before a process is started") {
  const MeshFolder files;
  const auto why = [](const std::string& path) {
    return ReadMeshFile(path, 1, {}, PLUMBLINE_MESH).error();
  };
  CHECK_THAT(why(files.folder.path() + "/none.stl"), Catch::Contains("No such file"));
  CHECK_THAT(why(files.Write("a.step", "x")), Catch::Contains("must end in .wrl, .stl"));
  CHECK_THAT(why(files.Write("a.stl", "")), Catch::Contains("is empty"));
  std::filesystem::create_directory(files.folder.path() + "/b.stl");
  CHECK_THAT(why(files.folder.path() + "/b.stl"), Catch::Contains("not a regular file"));
  REQUIRE(mkfifo((files.folder.path() + "/c.stl").c_str(), 0600) == 0);
  CHECK_THAT(why(files.folder.path() + "/c.stl"), Catch::Contains("not a regular file"));
}

TEST_CASE("reading does not block the caller and can be cancelled") {
  const MeshFolder files;
  const std::string path =
      files.Write("a.obj", MeshFileText(test::Sphere(1, 50, 50), MeshFormat::kObj));
  MeshReader reader({}, PLUMBLINE_MESH);
  CHECK(reader.idle());
  CHECK_FALSE(reader.Poll(0));
  REQUIRE(reader.Start(path, 1));
  CHECK_FALSE(reader.idle());
  std::optional<Result<MeshFile>> answer;
  while (!answer) answer = reader.Poll(0.01);
  CHECK(answer->ok());
  CHECK(reader.idle());
  REQUIRE(reader.Start(path, 1));
}
