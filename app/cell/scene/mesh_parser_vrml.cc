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
#include <Inventor/actions/SoCallbackAction.h>
#include <Inventor/errors/SoDebugError.h>
#include <Inventor/errors/SoReadError.h>
#include <Inventor/misc/SoProto.h>
#include <Inventor/nodes/SoShape.h>
#include <fmt/format.h>

#include <algorithm>
#include <string_view>

#include "app/cell/scene/mesh_parser.h"

namespace plumbline::cell {
namespace {

struct VrmlReading {
  RawMesh raw;
  std::uint64_t most_triangles = 0, nodes = 0;
  bool clockwise = false;  ///< vertex order of the present shape's faces
  std::string refusal;     ///< why the traversal was aborted
  std::string read_error;  ///< first error reported by Coin
  std::string missing;     ///< geometry in another file
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
  if (reading.missing.empty()) reading.missing = what;
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
    SbVec3f p;
    X.multVecMatrix(vertex->getPoint(), p);
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
    const bool older = text.substr(0, 10) == "#VRML V1.0";
    const bool packed = text.substr(0, 2) == "\x1f\x8b";
    return Error{fmt::format("not VRML97: it does not start with \"{}\"{}", kHeader,
                             older    ? "; it is VRML 1.0: export it as VRML 2.0 (VRML97)"
                             : packed ? "; it is compressed: unpack it with gunzip"
                                      : "")};
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
  if (!reading.missing.empty()) {
    return Error{
        fmt::format("it refers to geometry in another file, which is never opened: {}; export "
                    "everything into one file",
                    reading.missing)};
  }
  if (!reading.read_error.empty()) {
    return Error{fmt::format("damaged VRML97: {}", reading.read_error)};
  }
  if (reading.raw.mesh.triangles.size() > most_triangles) {
    return TooManyTriangles(reading.raw.mesh.triangles.size(), most_triangles);
  }
  return std::move(reading.raw);
}

}  // namespace plumbline::cell
