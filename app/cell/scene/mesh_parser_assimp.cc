// Parser of STL, OBJ, PLY and glTF, by Assimp.
#include <assimp/importerdesc.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <fmt/format.h>

#include <algorithm>
#include <assimp/IOStream.hpp>
#include <assimp/IOSystem.hpp>
#include <assimp/Importer.hpp>
#include <cctype>
#include <cstring>
#include <memory>

#include "app/cell/scene/mesh_parser.h"

namespace plumbline::cell {
namespace {

/// Assimp stream over bytes in memory.
class BytesStream : public Assimp::IOStream {
 public:
  explicit BytesStream(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}

  std::size_t Read(void* to, std::size_t size, std::size_t count) override {
    if (size == 0) return 0;
    const std::size_t whole = std::min(count, (bytes_.size() - at_) / size);
    if (whole > 0) std::memcpy(to, bytes_.data() + at_, whole * size);
    at_ += whole * size;
    return whole;
  }
  std::size_t Write(const void*, std::size_t, std::size_t) override { return 0; }
  aiReturn Seek(std::size_t offset, aiOrigin origin) override {
    const std::size_t base = origin == aiOrigin_SET   ? 0
                             : origin == aiOrigin_CUR ? at_
                                                      : bytes_.size();
    const std::size_t to = base + offset;  // negative offsets wrap around, as intended
    if (to > bytes_.size()) return aiReturn_FAILURE;
    at_ = to;
    return aiReturn_SUCCESS;
  }
  std::size_t Tell() const override { return at_; }
  std::size_t FileSize() const override { return bytes_.size(); }
  void Flush() override {}

 private:
  std::span<const std::uint8_t> bytes_;
  std::size_t at_ = 0;
};

/// Assimp file system with a single file; every other name is recorded in `outside`.
class OneFile : public Assimp::IOSystem {
 public:
  OneFile(std::string name, std::span<const std::uint8_t> bytes, RawMesh& raw)
      : name_(std::move(name)), bytes_(bytes), raw_(raw) {}

  bool Exists(const char* file) const override { return file == name_; }
  char getOsSeparator() const override { return '/'; }
  Assimp::IOStream* Open(const char* file, const char*) override {
    if (file == name_) return new BytesStream(bytes_);
    if (file != name_.substr(0, name_.rfind('.')) + ".mtl") NoteOutside(raw_, file);  // its guess
    return nullptr;
  }
  void Close(Assimp::IOStream* stream) override { delete stream; }

 private:
  std::string name_;
  std::span<const std::uint8_t> bytes_;
  RawMesh& raw_;
};

/// Unregisters all importers except that of the suffix, so that none guesses the content.
void KeepOneImporter(Assimp::Importer& importer, std::string_view suffix) {
  for (std::size_t i = importer.GetImporterCount(); i-- > 0;) {
    const std::string suffixes = fmt::format(" {} ", importer.GetImporterInfo(i)->mFileExtensions);
    if (suffixes.find(fmt::format(" {} ", suffix)) != std::string::npos) continue;
    importer.UnregisterLoader(importer.GetImporter(i));
  }
}

/// Lengths of the transformed unit vectors.
Vec3f ScaleOf(const aiMatrix4x4& X) {
  return {Vec3f(X.a1, X.b1, X.c1).norm(), Vec3f(X.a2, X.b2, X.c2).norm(),
          Vec3f(X.a3, X.b3, X.c3).norm()};
}

/// Merges the meshes of all nodes, transformed by their poses, into one mesh.
class Gatherer {
 public:
  Gatherer(const aiScene& scene, std::uint64_t most_triangles, RawMesh& raw)
      : scene_(scene), most_(most_triangles), raw_(raw) {}

  Result<void> Add(const aiNode& node, const aiMatrix4x4& X_parent, int depth) {
    if (depth > kDeepestNode || ++nodes_ > kMostNodes) {
      return Error{"too many nodes, or nested too deeply: flatten the model, or export it again"};
    }
    const aiMatrix4x4 X = X_parent * node.mTransformation;
    const aiMatrix4x4& own = node.mTransformation;
    NoteCoordinates(raw_, ScaleOf(X_parent).cwiseProduct(Vec3f(own.a4, own.b4, own.c4)));
    for (unsigned i = 0; i < node.mNumMeshes; ++i) {
      if (node.mMeshes[i] >= scene_.mNumMeshes)
        return Error{"a node refers to a missing mesh: export it again"};
      if (auto added = Add(*scene_.mMeshes[node.mMeshes[i]], X); !added) return added;
    }
    for (unsigned i = 0; i < node.mNumChildren; ++i) {
      if (auto added = Add(*node.mChildren[i], X, depth + 1); !added) return added;
    }
    return {};
  }

 private:
  Result<void> Add(const aiMesh& mesh, const aiMatrix4x4& X) {
    scene::TriangleMesh& all = raw_.mesh;
    const auto first = static_cast<std::uint32_t>(all.vertices_O.size());
    const std::uint64_t count = all.triangles.size() + mesh.mNumFaces;
    if (count > most_) return TooManyTriangles(count, most_);
    if (all.vertices_O.size() + mesh.mNumVertices > 3 * most_) {
      return Error{fmt::format("{} vertices for {} triangles: repair the model, or export it again",
                               all.vertices_O.size() + mesh.mNumVertices, count)};
    }
    const Vec3f scale = ScaleOf(X);
    for (unsigned i = 0; i < mesh.mNumVertices; ++i) {
      const aiVector3D& stored = mesh.mVertices[i];
      const aiVector3D p = X * stored;
      NoteCoordinates(raw_, scale.cwiseProduct(Vec3f(stored.x, stored.y, stored.z)));
      NoteCoordinates(raw_, {p.x, p.y, p.z});
      all.vertices_O.emplace_back(p.x, p.y, p.z);
    }
    const bool mirrored = X.Determinant() < 0;
    for (unsigned i = 0; i < mesh.mNumFaces; ++i) {
      const aiFace& face = mesh.mFaces[i];
      if (face.mNumIndices != 3) {
        ++raw_.other_elements;
        continue;
      }
      scene::Triangle triangle{};
      for (std::size_t k = 0; k < 3; ++k) {
        const unsigned index = face.mIndices[k];
        // Keep an invalid index invalid; CheckMesh() reports it.
        triangle[k] = index < mesh.mNumVertices ? first + index : ~0U;
      }
      if (mirrored) std::swap(triangle[1], triangle[2]);
      all.triangles.push_back(triangle);
    }
    return {};
  }

  const aiScene& scene_;
  const std::uint64_t most_;
  RawMesh& raw_;
  std::uint64_t nodes_ = 0;
};

/// Lists the textures that materials refer to.
void NoteTextures(const aiScene& scene, RawMesh& raw) {
  for (unsigned i = 0; i < scene.mNumMaterials; ++i) {
    for (int type = aiTextureType_NONE + 1; type <= AI_TEXTURE_TYPE_MAX; ++type) {
      aiString name;
      const bool named = scene.mMaterials[i]->GetTexture(static_cast<aiTextureType>(type), 0,
                                                         &name) == aiReturn_SUCCESS;
      if (named && name.length > 0 && name.data[0] != '*') NoteOutside(raw, name.C_Str());
    }
  }
}

std::string NamesText(const RawMesh& raw) {
  std::string text;
  for (const std::string& name : raw.outside) text += (text.empty() ? "" : ", ") + name;
  return text;
}

}  // namespace

Result<RawMesh> ParseWithAssimp(MeshFormat format, std::span<const std::uint8_t> bytes,
                                std::uint64_t most_triangles) {
  RawMesh raw;
  const std::string name = fmt::format("plumbline-mesh.{}", WordOf(format));
  Assimp::Importer importer;
  importer.SetIOHandler(new OneFile(name, bytes, raw));
  KeepOneImporter(importer, WordOf(format));
  const aiScene* scene =
      importer.ReadFile(name, aiProcess_ValidateDataStructure | aiProcess_Triangulate);
  if (scene == nullptr || scene->mRootNode == nullptr) {
    std::string why =
        fmt::format("not a readable {} file: {}", WordOf(format), importer.GetErrorString());
    if (!raw.outside.empty()) {
      why += fmt::format(
          "; it refers to other files, which are never opened ({}): export everything into one "
          "file",
          NamesText(raw));
    }
    return Error{why};
  }
  const Result<void> added = Gatherer(*scene, most_triangles, raw).Add(*scene->mRootNode, {}, 0);
  if (!added) return added.failure();
  NoteTextures(*scene, raw);
  return raw;
}

}  // namespace plumbline::cell
