// Parser of VRML97, by Coin.
#include <Inventor/SbMatrix.h>
#include <Inventor/SoDB.h>
#include <Inventor/SoInput.h>
#include <Inventor/SoPrimitiveVertex.h>
#include <Inventor/VRMLnodes/SoVRMLAppearance.h>
#include <Inventor/VRMLnodes/SoVRMLCoordinate.h>
#include <Inventor/VRMLnodes/SoVRMLElevationGrid.h>
#include <Inventor/VRMLnodes/SoVRMLExtrusion.h>
#include <Inventor/VRMLnodes/SoVRMLGroup.h>
#include <Inventor/VRMLnodes/SoVRMLImageTexture.h>
#include <Inventor/VRMLnodes/SoVRMLIndexedFaceSet.h>
#include <Inventor/VRMLnodes/SoVRMLInline.h>
#include <Inventor/VRMLnodes/SoVRMLTransform.h>
#include <Inventor/actions/SoCallbackAction.h>
#include <Inventor/errors/SoDebugError.h>
#include <Inventor/errors/SoReadError.h>
#include <Inventor/misc/SoProto.h>
#include <Inventor/nodes/SoShape.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <iterator>
#include <string_view>
#include <utility>
#include <vector>

#include "app/cell/scene/mesh_parser.h"

namespace plumbline::cell {
namespace {

struct VrmlReading {
  RawMesh raw;
  std::uint64_t most_triangles = 0, nodes = 0;
  bool clockwise = false;            ///< vertex order of the present shape's faces
  std::string refusal;               ///< why the traversal was aborted
  std::string read_error;            ///< first error reported by Coin
  std::vector<std::string> missing;  ///< geometry in other files
};

void KeepFirstError(const SoError* error, void* data) {
  auto& reading = *static_cast<VrmlReading*>(data);
  const std::string_view text = error->getDebugString().getString();
  if (!reading.read_error.empty() || text.find("texture file") != text.npos) return;
  for (const char c : text) {
    reading.read_error += c == '\n' || c == '\t' ? ' ' : c;
  }
}

void IgnoreError(const SoError*, void*) {}

void NoteMissing(VrmlReading& reading, const std::string& what) {
  std::vector<std::string>& missing = reading.missing;
  const bool known = std::find(missing.begin(), missing.end(), what) != missing.end();
  if (!known && missing.size() < kMaxReferences) missing.push_back(what);
}

/// Coin does not check indices and would read beyond the coordinates.
void CheckIndices(VrmlReading& reading, const SoVRMLIndexedFaceSet& faces) {
  const SoNode* coord = faces.coord.getValue();
  const bool known = coord != nullptr && coord->isOfType(SoVRMLCoordinate::getClassTypeId());
  const int count = known ? static_cast<const SoVRMLCoordinate*>(coord)->point.getNum() : 0;
  const int32_t* const indices = faces.coordIndex.getValues(0);
  const auto beyond = std::count_if(indices, indices + faces.coordIndex.getNum(),
                                    [count](int32_t i) { return i >= count || i < -1; });
  if (beyond == 0) return;
  reading.refusal = fmt::format(
      "an IndexedFaceSet with {} points has {} indices out of range: repair the model, or export "
      "it again",
      count, beyond);
}

bool RunsClockwise(const SoNode& node) {
  for (const SoType type :
       {SoVRMLIndexedFaceSet::getClassTypeId(), SoVRMLElevationGrid::getClassTypeId(),
        SoVRMLExtrusion::getClassTypeId()}) {
    if (!node.isOfType(type)) continue;
    const SoField* ccw = node.getField("ccw");
    return ccw != nullptr && !static_cast<const SoSFBool*>(ccw)->getValue();
  }
  return false;
}

void RefuseInline(const SbString& url, void* data, SoVRMLInline* node) {
  auto& reading = *static_cast<VrmlReading*>(data);
  NoteMissing(reading, fmt::format("Inline \"{}\"", url.getString()));
  node->cancelURLDataRequest();
}

SoProto* RefuseExternProto(SoInput*, const SbString* urls, const int count, void* data) {
  auto& reading = *static_cast<VrmlReading*>(data);
  NoteMissing(reading, fmt::format("EXTERNPROTO \"{}\"", count > 0 ? urls[0].getString() : ""));
  return nullptr;
}

/// Coin may stop at the first such reference, so all of them are looked up in the text.
Error MissingError(VrmlReading& reading, std::string_view text) {
  for (const std::string_view key : {"EXTERNPROTO", "Inline"}) {
    for (auto at = text.find(key); at != text.npos; at = text.find(key, at + key.size())) {
      const auto first = text.find('"', at), last = text.find('"', first + 1);
      if (first == text.npos || last == text.npos) break;
      const auto url = text.substr(first + 1, std::min(last - first - 1, kMaxReferenceLength));
      NoteMissing(reading, fmt::format("{} \"{}\"", key, url));
    }
  }
  return Error{fmt::format(
      "it refers to geometry in other files, which are never opened: {}; export everything into "
      "one file",
      fmt::join(reading.missing, ", "))};
}

void NoteUrls(RawMesh& raw, const SoMFString& urls) {
  for (int i = 0; i < urls.getNum(); ++i) NoteOutside(raw, urls[i].getString());
}

SoCallbackAction::Response AtNode(void* data, SoCallbackAction* action, const SoNode* node) {
  auto& reading = *static_cast<VrmlReading*>(data);
  if (action->getCurPath()->getLength() > kDeepestNode) {
    reading.refusal = fmt::format(
        "nodes are nested more than {} deep, or USE themselves: export it again", kDeepestNode);
  } else if (++reading.nodes > kMostNodes) {
    reading.refusal = fmt::format(
        "more than {} nodes after expanding DEF and USE: simplify the model", kMostNodes);
  } else if (reading.raw.mesh.triangles.size() > reading.most_triangles) {
    reading.refusal =
        TooManyTriangles(reading.raw.mesh.triangles.size(), reading.most_triangles).message;
  }
  if (node->isOfType(SoVRMLTransform::getClassTypeId())) {
    const auto& transform = *static_cast<const SoVRMLTransform*>(node);
    for (const SoSFVec3f* offset : {&transform.translation, &transform.center}) {
      const SbVec3f& p = offset->getValue();
      NoteCoordinates(reading.raw, p[0], p[1], p[2]);
    }
  }
  if (node->isOfType(SoVRMLIndexedFaceSet::getClassTypeId())) {
    CheckIndices(reading, *static_cast<const SoVRMLIndexedFaceSet*>(node));
  }
  if (!reading.refusal.empty()) return SoCallbackAction::ABORT;
  reading.clockwise = RunsClockwise(*node);
  if (node->isOfType(SoVRMLInline::getClassTypeId())) {
    const auto& urls = static_cast<const SoVRMLInline*>(node)->url;
    NoteMissing(reading,
                fmt::format("Inline \"{}\"", urls.getNum() > 0 ? urls[0].getString() : ""));
  } else if (node->isOfType(SoVRMLAppearance::getClassTypeId())) {
    const SoNode* texture = static_cast<const SoVRMLAppearance*>(node)->texture.getValue();
    if (texture != nullptr && texture->isOfType(SoVRMLImageTexture::getClassTypeId())) {
      NoteUrls(reading.raw, static_cast<const SoVRMLImageTexture*>(texture)->url);
    }
  }
  return SoCallbackAction::CONTINUE;
}

void AtTriangle(void* data, SoCallbackAction* action, const SoPrimitiveVertex* a,
                const SoPrimitiveVertex* b, const SoPrimitiveVertex* c) {
  auto& reading = *static_cast<VrmlReading*>(data);
  scene::TriangleMesh& mesh = reading.raw.mesh;
  if (mesh.triangles.size() > reading.most_triangles) return;  // the next node aborts the traversal
  const SbMatrix& X = action->getModelMatrix();
  const auto first = static_cast<std::uint32_t>(mesh.vertices_O.size());
  for (const SoPrimitiveVertex* vertex : {a, b, c}) {
    const SbVec3f& stored = vertex->getPoint();
    SbVec3f p;
    X.multVecMatrix(stored, p);
    NoteCoordinates(reading.raw, stored[0], stored[1], stored[2]);
    NoteCoordinates(reading.raw, p[0], p[1], p[2]);
    mesh.vertices_O.emplace_back(p[0], p[1], p[2]);
  }
  // Coin does not reverse clockwise faces; a mirroring transformation reverses faces once more.
  const bool turned = reading.clockwise != (X.det3() < 0);
  mesh.triangles.push_back({first, first + (turned ? 2 : 1), first + (turned ? 1 : 2)});
}

void AtLine(void* data, SoCallbackAction*, const SoPrimitiveVertex*, const SoPrimitiveVertex*) {
  ++static_cast<VrmlReading*>(data)->raw.other_elements;
}

void AtPoint(void* data, SoCallbackAction*, const SoPrimitiveVertex*) {
  ++static_cast<VrmlReading*>(data)->raw.other_elements;
}

}  // namespace

void PrepareVrmlParser() {
  SoDB::init();
}

Result<RawMesh> ParseVrml(std::span<const std::uint8_t> bytes, std::uint64_t most_triangles) {
  constexpr std::string_view kHeader = "#VRML V2.0 utf8";
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  if (text.substr(0, kHeader.size()) != kHeader) {
    constexpr std::pair<std::string_view, const char*> kOthers[] = {
        {"#VRML V1.0", "; it is VRML 1.0: export it as VRML 2.0 (VRML97)"},
        {"#Inventor",
         "; it is Open Inventor (Coin, SGI): export it as VRML 2.0 (VRML97), STL or OBJ from the "
         "program that wrote it"},
        {"#X3D", "; it is X3D: export it as VRML 2.0 (VRML97)"},
        {"<?xml", "; it is XML, for example X3D: export it as VRML 2.0 (VRML97)"},
        {"\x1f\x8b", "; it is compressed: unpack it with gunzip"},
    };
    const auto* const other =
        std::find_if(std::begin(kOthers), std::end(kOthers),
                     [text](const auto& known) { return text.starts_with(known.first); });
    return Error{fmt::format("not VRML97: it does not start with \"{}\"{}", kHeader,
                             other == std::end(kOthers) ? "" : other->second)};
  }
  VrmlReading reading;
  reading.most_triangles = most_triangles;
  SoReadError::setHandlerCallback(KeepFirstError, &reading);
  SoDebugError::setHandlerCallback(IgnoreError, nullptr);
  SoVRMLInline::setFetchURLCallBack(RefuseInline, &reading);
  SoVRMLImageTexture::setDelayFetchURL(TRUE);
  SoProto::setFetchExternProtoCallback(RefuseExternProto, &reading);
  SoInput input;
  input.setBuffer(bytes.data(), bytes.size());
  SoVRMLGroup* const root = SoDB::readAllVRML(&input);
  if (root == nullptr) {
    if (!reading.missing.empty()) return MissingError(reading, text);
    return Error{fmt::format("not readable as VRML97: {}", reading.read_error)};
  }
  root->ref();  // never released: deleting a malicious scene could exhaust the stack
  SoCallbackAction walk;
  walk.addPreCallback(SoNode::getClassTypeId(), AtNode, &reading);
  walk.addTriangleCallback(SoShape::getClassTypeId(), AtTriangle, &reading);
  walk.addLineSegmentCallback(SoShape::getClassTypeId(), AtLine, &reading);
  walk.addPointCallback(SoShape::getClassTypeId(), AtPoint, &reading);
  walk.apply(root);

  if (!reading.refusal.empty()) return Error{reading.refusal};
  if (!reading.missing.empty()) return MissingError(reading, text);
  if (!reading.read_error.empty()) {
    return Error{fmt::format("damaged VRML97: {}", reading.read_error)};
  }
  if (reading.raw.mesh.triangles.size() > most_triangles) {
    return TooManyTriangles(reading.raw.mesh.triangles.size(), most_triangles);
  }
  return std::move(reading.raw);
}

}  // namespace plumbline::cell
