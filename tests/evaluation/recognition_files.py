"""Invented files of the kinds that `plumbline explain` recognises, and mutations of them.

Each maker draws one variant from a random generator and returns (name, bytes, facts): facts are what
the answer must state, and `contradiction` is the word of a contradiction that was planted."""

import gzip
import io
import json
import math
import struct
import zipfile
import zlib

JOINT_SETS = (["q%d", "joint%d", "A%d", "axis_%d"])


def number(rng, low, high, digits=6):
    return ("%%.%df" % digits) % rng.uniform(low, high)


def lens_numbers(rng):
    width, height = rng.choice([(640, 480), (1280, 720), (1920, 1080), (2448, 2048), (1600, 1200)])
    focal = rng.uniform(0.7, 2.0) * width
    return (width, height, focal, focal * rng.uniform(0.99, 1.01), width / 2 + rng.uniform(-20, 20),
            height / 2 + rng.uniform(-20, 20))


def terms_of(rng, count):
    small = [rng.uniform(-0.12, 0.05), rng.uniform(-0.01, 0.02), rng.uniform(-1e-3, 1e-3), rng.uniform(-1e-3, 1e-3)]
    return (small + [rng.uniform(-1e-4, 1e-4) for _ in range(20)])[:count]


def listed(values):
    return ", ".join("%.10g" % value for value in values)


def size_fact(lens):
    return {"image size": "%d x %d px" % lens[:2]}


def opencv_lens(rng):
    w, h, fx, fy, cx, cy = lens = lens_numbers(rng)
    count, planted = rng.choice([4, 5, 8, 12]), rng.random()
    terms, cols, skew, contradiction = terms_of(rng, count), 1, 0.0, None
    rows = count
    if planted < 0.15:
        rows, contradiction = count + 1, "distortion_coefficients"
    elif planted < 0.3:
        skew, contradiction = 1.7, "skew"
    elif planted < 0.45:
        terms, contradiction = [-2.5, 0.0, 0.0, 0.0] + [0.0] * (count - 4), "distortion"
    camera = [fx, skew, cx, 0, fy, cy, 0, 0, 1]
    camera[:6] = [fx, skew, cx, 0.0, fy, cy]
    if rng.random() < 0.5:
        def matrix(name, r, c, data):
            return ('<%s type_id="opencv-matrix">\n  <rows>%d</rows>\n  <cols>%d</cols>\n  <dt>d</dt>\n  <data>\n    %s</data></%s>\n'
                    % (name, r, c, " ".join("%.12g" % v for v in data), name))
        text = '<?xml version="1.0"?>\n<opencv_storage>\n<image_width>%d</image_width>\n<image_height>%d</image_height>\n' % (w, h)
        text += matrix(rng.choice(["camera_matrix", "Camera_Matrix"]), 3, 3, camera)
        text += matrix("distortion_coefficients", rows, cols, terms) + "</opencv_storage>\n"
        return "lens.xml", text.encode(), dict(size_fact(lens), contradiction=contradiction)
    def matrix(name, r, c, data):
        return "%s: !!opencv-matrix\n   rows: %d\n   cols: %d\n   dt: d\n   data: [ %s ]\n" % (name, r, c, listed(data))
    text = "%YAML:1.0\n---\n" + "image_width: %d\nimage_height: %d\n" % (w, h)
    text += matrix("camera_matrix", 3, 3, camera) + matrix("distortion_coefficients", rows, cols, terms)
    return "lens.yml", text.encode(), dict(size_fact(lens), contradiction=contradiction)


def ros_camera_info(rng):
    w, h, fx, fy, cx, cy = lens = lens_numbers(rng)
    model, count = rng.choice([("plumb_bob", 5), ("rational_polynomial", 8), ("equidistant", 4)])
    contradiction, given = None, count
    if rng.random() < 0.3:
        given, contradiction = {5: 8, 8: 5, 4: 5}[count], "distortion"
    terms = terms_of(rng, given)
    if model == "equidistant":
        terms = [0.01 * rng.uniform(-1, 1) for _ in range(given)]
    flow = rng.random() < 0.6
    def matrix(name, r, c, data):
        body = "[%s]" % listed(data) if flow else "".join("\n  - %.10g" % v for v in data)
        return "%s:\n  rows: %d\n  cols: %d\n  data: %s\n" % (name, r, c, body)
    text = "image_width: %d\nimage_height: %d\ncamera_name: narrow_stereo\n" % (w, h)
    text += matrix("camera_matrix", 3, 3, [fx, 0, cx, 0, fy, cy, 0, 0, 1])
    text += "distortion_model: %s\n" % model + matrix("distortion_coefficients", 1, given, terms)
    text += matrix("rectification_matrix", 3, 3, [1, 0, 0, 0, 1, 0, 0, 0, 1])
    text += matrix("projection_matrix", 3, 4, [fx, 0, cx, 0, 0, fy, cy, 0, 0, 0, 1, 0])
    return "ost.yaml", text.encode(), dict(size_fact(lens), contradiction=contradiction)


def ros_ini(rng):
    w, h, fx, fy, cx, cy = lens_numbers(rng)
    def rows(data, width):
        return "".join(" ".join("%.6f" % v for v in data[k:k + width]) + "\n" for k in range(0, len(data), width))
    text = "# oST version 5.0 parameters\n\n[image]\n\nwidth\n%d\n\nheight\n%d\n\n[narrow_stereo]\n\n" % (w, h)
    text += "camera matrix\n" + rows([fx, 0, cx, 0, fy, cy, 0, 0, 1], 3) + "\ndistortion\n" + rows(terms_of(rng, 5), 5)
    text += "\nrectification\n" + rows([1, 0, 0, 0, 1, 0, 0, 0, 1], 3)
    text += "\nprojection\n" + rows([fx, 0, cx, 0, 0, fy, cy, 0, 0, 0, 1, 0], 4)
    return "ost.ini", text.encode(), {}


def ros_echo(rng):
    w, h, fx, fy, cx, cy = lens = lens_numbers(rng)
    terms, k = terms_of(rng, 5), [fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0]
    binning = rng.choice([0, 0, 2])
    contradiction = "binning" if binning > 1 else None
    if rng.random() < 0.5:
        text = "header: \n  seq: 12\n  stamp: \n    secs: 1\n    nsecs: 5\n  frame_id: \"camera\"\nheight: %d\nwidth: %d\n" % (h, w)
        text += "distortion_model: \"plumb_bob\"\nD: [%s]\nK: [%s]\nR: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]\n" % (listed(terms), listed(k))
        text += "P: [%s]\nbinning_x: %d\nbinning_y: %d\nroi: \n  x_offset: 0\n  y_offset: 0\n  height: 0\n  width: 0\n  do_rectify: False\n---\n" % (listed(k[:3] + [0] + k[3:6] + [0] + k[6:] + [0]), binning, binning)
    else:
        def block(name, data):
            return "%s:\n" % name + "".join("- %.10g\n" % v for v in data)
        text = "header:\n  stamp:\n    sec: 1\n    nanosec: 5\n  frame_id: camera\nheight: %d\nwidth: %d\ndistortion_model: plumb_bob\n" % (h, w)
        text += block("d", terms) + block("k", k) + block("r", [1, 0, 0, 0, 1, 0, 0, 0, 1])
        text += block("p", k[:3] + [0] + k[3:6] + [0] + k[6:] + [0]) + "binning_x: %d\nbinning_y: %d\nroi:\n  x_offset: 0\n  y_offset: 0\n  height: 0\n  width: 0\n  do_rectify: false\n---\n" % (binning, binning)
    return "info.txt", text.encode(), dict(size_fact(lens), contradiction=contradiction)


def kalibr(rng):
    cameras, text, lens = rng.choice([1, 2]), "", None
    contradiction = "distortion" if rng.random() < 0.3 else None
    for camera in range(cameras):
        w, h, fx, fy, cx, cy = lens = lens_numbers(rng)
        model = rng.choice(["radtan", "equidistant"])
        terms = [0.01 * rng.uniform(-1, 1) for _ in range(5 if contradiction else 4)]
        text += "cam%d:\n  cam_overlaps: []\n  camera_model: pinhole\n  distortion_coeffs: [%s]\n  distortion_model: %s\n" % (camera, listed(terms), model)
        text += "  intrinsics: [%s]\n  resolution: [%d, %d]\n  rostopic: /cam%d/image_raw\n" % (listed([fx, fy, cx, cy]), w, h, camera)
    return "camchain.yaml", text.encode(), dict(size_fact(lens), cameras=str(cameras), contradiction=contradiction)


def mrcal(rng):
    w, h, fx, fy, cx, cy = lens = lens_numbers(rng)
    count = rng.choice([4, 5, 8, 12])
    given = count + (rng.choice([0, 0, 1]))
    text = "# generated by mrcal\n# RMS 0.3\n{\n    'lensmodel':  'LENSMODEL_OPENCV%d',\n\n    # intrinsics are fx,fy,cx,cy,distortion0,...\n" % count
    text += "    'intrinsics': [ %s,],\n    'valid_intrinsics_region': [\n        [ 10, 20 ],\n        [ 30, 40 ]\n    ],\n" % listed([fx, fy, cx, cy] + terms_of(rng, given))
    text += "    'extrinsics': [ 0,0,0,0,0,0, ],\n    'imagersize': [ %d, %d,],\n    'icam_intrinsics': 0,\n}\n" % (w, h)
    return "camera-0.cameramodel", text.encode(), dict(size_fact(lens), contradiction="distortion" if given != count else None)


def colmap(rng):
    w, h, fx, fy, cx, cy = lens = lens_numbers(rng)
    model, values = rng.choice([("PINHOLE", [fx, fy, cx, cy]), ("SIMPLE_RADIAL", [fx, cx, cy, -0.02]),
                                ("OPENCV", [fx, fy, cx, cy] + terms_of(rng, 4)), ("RADIAL", [fx, cx, cy, -0.02, 0.001])])
    contradiction = None
    if rng.random() < 0.3:
        values, contradiction = values[:-1], "parameters"
    text = "# Camera list with one line of data per camera:\n#   CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]\n# Number of cameras: 1\n"
    text += "1 %s %d %d %s\n" % (model, w, h, " ".join("%.9g" % v for v in values))
    return "cameras.txt", text.encode(), dict({} if contradiction else size_fact(lens), contradiction=contradiction)


def artoolkit(rng):
    w, h, fx, fy, cx, cy = lens = lens_numbers(rng)
    count = rng.choice([4, 12])
    data = struct.pack(">ii", w, h) + struct.pack(">12d", fx, 0, cx, 0, 0, fy, cy, 0, 0, 0, 1, 0)
    data += struct.pack(">%dd" % (count + 5), *(terms_of(rng, count) + [fx, fy, cx, cy, 1.0]))
    return "camera_para.dat", data, size_fact(lens)


def urdf(rng):
    joints = rng.choice([4, 5, 6, 7])
    prefix = rng.choice(["", "arm_", "panda_"])
    text = '<?xml version="1.0"?>\n<robot name="invented">\n'
    text += "".join('  <link name="%slink%d"/>\n' % (prefix, k) for k in range(joints + 1))
    contradiction = None
    for k in range(joints):
        child = k + 1
        if k == joints - 1 and rng.random() < 0.25:
            child, contradiction = 99, "joint"
        text += ('  <joint name="%sj%d" type="revolute">\n    <origin xyz="%s 0 %s" rpy="%s 0 0"/>\n    <parent link="%slink%d"/>\n'
                 '    <child link="%slink%d"/>\n    <axis xyz="0 0 1"/>\n    <limit lower="-3" upper="3" effort="10" velocity="2"/>\n  </joint>\n'
                 % (prefix, k + 1, number(rng, -0.5, 0.5), number(rng, 0, 0.5), number(rng, -1.6, 1.6), prefix, k, prefix, child))
    return "arm.urdf", (text + "</robot>\n").encode(), {"joints": "%d: %d revolute" % (joints, joints), "contradiction": contradiction}


def xacro(rng):
    text = '<?xml version="1.0"?>\n<robot xmlns:xacro="http://www.ros.org/wiki/xacro" name="%s">\n' % rng.choice(["ur", "arm"])
    text += '  <xacro:property name="d1" value="%s"/>\n' % number(rng, 0, 0.5)
    text += '  <xacro:macro name="arm" params="prefix">\n    <link name="${prefix}base"/>\n    <joint name="${prefix}j1" type="revolute">\n'
    text += '      <origin xyz="0 0 ${d1}" rpy="0 0 0"/>\n    </joint>\n  </xacro:macro>\n  <xacro:arm prefix="a_"/>\n</robot>\n'
    return rng.choice(["arm.urdf.xacro", "arm.urdf"]), text.encode(), {}


def factory_table(names):
    def make(rng):
        text = "kinematics:\n"
        for name in names:
            text += "  %s:\n" % name + "".join("    %s: %s\n" % (key, number(rng, -1.6, 1.6, 12)) for key in ("x", "y", "z", "roll", "pitch", "yaw"))
        if names[0] == "shoulder" and rng.random() < 0.8:
            text += "  hash: calib_%d\n" % rng.randrange(10**18)
        return rng.choice(["kinematics.yaml", "default_kinematics.yaml"]), text.encode(), {"joints": "6: " + ", ".join(names)}
    return make


def sdf(rng):
    joints = rng.randrange(3, 8)
    text = "<?xml version='1.0'?>\n<sdf version='%s'>\n  <model name='arm'>\n" % rng.choice(["1.6", "1.7", "1.9"])
    text += "".join("    <link name='l%d'><pose>0 0 %s 0 0 0</pose></link>\n" % (k, number(rng, 0, 1)) for k in range(joints + 1))
    text += "".join("    <joint name='j%d' type='revolute'><parent>l%d</parent><child>l%d</child></joint>\n" % (k, k, k + 1) for k in range(joints))
    return "model.sdf", (text + "  </model>\n</sdf>\n").encode(), {"joints": str(joints)}


def mjcf(rng):
    text = '<mujoco model="arm">\n  <compiler angle="radian"/>\n  <worldbody>\n    <body name="b0" pos="0 0 %s">\n' % number(rng, 0, 1)
    text += '      <joint name="j0" axis="0 0 1" range="-3 3"/>\n      <geom type="capsule" size="0.05 0.2"/>\n    </body>\n  </worldbody>\n</mujoco>\n'
    return rng.choice(["arm.xml", "scene.mjcf"]), text.encode(), {}


def rows_of(rng, columns, count, separator=",", comma=False):
    lines = []
    for row in range(count):
        fields = [str(make(row)) for make in columns]
        if comma:
            fields = [field.replace(".", ",") for field in fields]
        lines.append(separator.join(fields))
    return "\n".join(lines) + "\n"


def dh_table(rng):
    joints = rng.choice([4, 5, 6, 7])
    names = rng.choice([["joint", "a", "alpha", "d", "theta"], ["i", "theta", "d", "a", "alpha"], ["a_mm", "alpha_deg", "d_mm", "theta_deg"]])
    columns = [(lambda row: row + 1) if name in ("joint", "i") else (lambda row: number(rng, -2, 2, 4)) for name in names]
    separator = rng.choice([",", ";", "\t"])
    return "dh.csv", (separator.join(names) + "\n" + rows_of(rng, columns, joints, separator)).encode(), {"joints": "%d rows" % joints}


def measured(rng):
    joints, count = rng.choice([4, 6, 7]), rng.randrange(8, 60)
    names = ["q%d_deg" % (k + 1) for k in range(joints)] + ["x_mm", "y_mm", "z_mm"]
    columns = [lambda row: number(rng, -170, 170, 5)] * joints + [lambda row: number(rng, -1500, 1500, 4)] * 3
    if rng.random() < 0.5:
        names, columns = ["t_s"] + names, [lambda row: "%.1f" % (10 * row)] + columns
    return "measured.csv", (",".join(names) + "\n" + rows_of(rng, columns, count)).encode(), {"joints": str(joints), "rows": str(count)}


def tracker(rng):
    count = rng.randrange(8, 60)
    names = ["X  [mm]", "Y  [mm]", "Z  [mm]", "U(95)  [mm]", "Image RMS  [um]", "Temperature  [C]", "Time Stamp"]
    columns = [lambda row: number(rng, -3000, 3000, 4)] * 3 + [lambda row: number(rng, 0.001, 0.02, 4)] * 2 + [lambda row: number(rng, 19, 23, 2), lambda row: "'08.11.2022 16:%02d:%02d.353" % (row % 60, row * 7 % 60)]
    text = ",".join(names) + "\r\n" + rows_of(rng, columns, count).replace("\n", "\r\n")
    return "leica.csv", text.encode("cp1252"), {"rows": str(count)}


def cmm(rng):
    count = rng.randrange(8, 40)
    german = rng.random() < 0.5
    names = ["Element", "Sollwert", "Istwert", "Abweichung"] if german else ["Element Name", "Number", "Deviation", "MX Coord.", "MY Coord.", "MZ Coord."]
    columns = [lambda row: "KUGEL%d" % row] + [lambda row: number(rng, -500, 500, 4)] * (len(names) - 1)
    separator = ";" if german else ","
    return "cmm.csv", (separator.join(names) + "\n" + rows_of(rng, columns, count, separator, german)).encode("cp1252"), {"rows": str(count)}


def rtde(rng):
    count = rng.randrange(8, 60)
    names = ["timestamp"] + ["actual_q_%d" % k for k in range(6)] + (["actual_TCP_pose_%d" % k for k in range(6)] if rng.random() < 0.6 else [])
    columns = [lambda row: "%.3f" % (8000 + 8 * row)] + [lambda row: number(rng, -3, 3, 12)] * (len(names) - 1)
    separator = rng.choice([" ", ","])
    return "record.csv", (separator.join(names) + "\n" + rows_of(rng, columns, count, separator)).encode(), {"rows": str(count)}


def ros_csv(rng):
    count = rng.randrange(8, 60)
    if rng.random() < 0.5:
        names = ["%time", "field.header.seq", "field.header.stamp", "field.header.frame_id"] + ["field.position%d" % k for k in range(6)]
        columns = [lambda row: 1600000000000000000 + 8000000 * row, lambda row: row, lambda row: 1600000000000000000 + 8000000 * row, lambda row: "base"]
    else:
        names = ["__time"] + ["/joint_states/joint%d/position" % k for k in range(6)]
        columns = [lambda row: "%.6f" % (1.6e9 + 0.008 * row)]
    columns += [lambda row: number(rng, -3, 3, 9)] * 6
    return "joint_states.csv", (",".join(names) + "\n" + rows_of(rng, columns, count)).encode(), {"rows": str(count)}


def vrml(header, point, kind_name):
    def make(rng):
        x, y, z = (rng.uniform(10, 900) for _ in range(3))
        corners = ",\n    ".join("%.3f %.3f %.3f" % (a * x, b * y, c * z) for c in (0, 1) for b in (0, 1) for a in (0, 1))
        faces = "0,2,3,1,-1,4,5,7,6,-1,0,1,5,4,-1,2,6,7,3,-1,0,4,6,2,-1,1,3,7,5,-1"
        text = header + "\n" + (point % (corners, faces))
        return kind_name, text.encode(), {"face sets": "1"}
    return make


VRML2 = "Shape { geometry IndexedFaceSet { solid TRUE\n  coord Coordinate { point [ %s ] }\n  coordIndex [ %s ] } }\n"
INVENTOR = "Separator {\n  Coordinate3 { point [ %s ] }\n  IndexedFaceSet { coordIndex [ %s ] }\n}\n"


def triangles(rng):
    return [[[rng.uniform(-100, 100) for _ in range(3)] for _ in range(3)] for _ in range(rng.randrange(4, 60))]


def stl_text(rng):
    faces = triangles(rng)
    text = "solid %s\n" % rng.choice(["part", "gripper exported 2026", ""])
    for face in faces:
        text += "  facet normal 0 0 1\n    outer loop\n" + "".join("      vertex %.5f %.5f %.5f\n" % tuple(v) for v in face) + "    endloop\n  endfacet\n"
    return "part.stl", (text + "endsolid part\n").encode(), {"triangles": str(len(faces))}


def stl_binary(rng):
    faces = triangles(rng)
    data = rng.choice([b"solid exported", b"Binary STL", b""]).ljust(80, rng.choice([b"\0", b" "])) + struct.pack("<I", len(faces))
    for face in faces:
        data += struct.pack("<12fH", 0, 0, 1, *[c for v in face for c in v], 0)
    return "part.stl", data, {"triangles": str(len(faces))}


def obj(rng):
    faces = triangles(rng)
    text = "# exported\nmtllib part.mtl\no part\n"
    text += "".join("v %.4f %.4f %.4f\n" % tuple(v) for face in faces for v in face)
    text += "".join("f %d %d %d\n" % (3 * k + 1, 3 * k + 2, 3 * k + 3) for k in range(len(faces)))
    return "part.obj", text.encode(), {"faces": str(len(faces))}


def ply(rng):
    faces = triangles(rng)
    binary = rng.random() < 0.5
    head = "ply\nformat %s 1.0\nelement vertex %d\nproperty float x\nproperty float y\nproperty float z\nelement face %d\nproperty list uchar int vertex_indices\nend_header\n" % (
        "binary_little_endian" if binary else "ascii", 3 * len(faces), len(faces))
    if binary:
        body = b"".join(struct.pack("<3f", *v) for face in faces for v in face)
        body += b"".join(struct.pack("<B3i", 3, 3 * k, 3 * k + 1, 3 * k + 2) for k in range(len(faces)))
    else:
        body = "".join("%.4f %.4f %.4f\n" % tuple(v) for face in faces for v in face).encode()
        body += "".join("3 %d %d %d\n" % (3 * k, 3 * k + 1, 3 * k + 2) for k in range(len(faces))).encode()
    return "part.ply", head.encode() + body, {"element": "face %d" % len(faces)}


def collada(rng):
    text = '<?xml version="1.0" encoding="utf-8"?>\n<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">\n  <asset><unit name="%s" meter="%s"/><up_axis>Z_UP</up_axis></asset>\n  <library_geometries/>\n</COLLADA>\n' % rng.choice([("meter", "1"), ("millimeter", "0.001")])
    return "part.dae", text.encode(), {"up axis": "Z_UP"}


def step(rng):
    text = "ISO-10303-21;\nHEADER;\nFILE_DESCRIPTION((''),'2;1');\nFILE_NAME('part.stp','2026-11-01T10:00:00',(''),(''),'','','');\nFILE_SCHEMA(('AUTOMOTIVE_DESIGN { 1 0 10303 214 1 1 1 1 }'));\nENDSEC;\nDATA;\n"
    text += "".join("#%d=CARTESIAN_POINT('',(%s,%s,0.));\n" % (k + 1, number(rng, -9, 9), number(rng, -9, 9)) for k in range(rng.randrange(5, 40)))
    return "part.stp", (text + "ENDSEC;\nEND-ISO-10303-21;\n").encode(), {}


def krl(rng):
    text = "&ACCESS RVP\r\n&REL 12\r\nDEFDAT %s PUBLIC\r\n" % rng.choice(["HANDLING", "STYLE1"])
    points = rng.randrange(2, 20)
    text += "".join("DECL E6POS XP%d={X %s,Y %s,Z %s,A 1.0,B 2.0,C 3.0,S 2,T 35,E1 0.0}\r\n" % (k, number(rng, -900, 900, 3), number(rng, -900, 900, 3), number(rng, 0, 900, 3)) for k in range(points))
    return "handling.dat", (text + "DECL E6AXIS XH={A1 0,A2 -90,A3 90,A4 0,A5 0,A6 0,E1 0}\r\nENDDAT\r\n").encode(), {"cartesian targets": str(points), "joint targets": "1"}


def rapid(rng):
    text = "MODULE Invented\r\n"
    count = rng.randrange(2, 20)
    text += "".join("  CONST robtarget p%d:=[[%s,%s,%s],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];\r\n" % (k, number(rng, -900, 900, 2), number(rng, -900, 900, 2), number(rng, 0, 900, 2)) for k in range(count))
    return "invented.mod", (text + "  PROC main()\r\n    MoveL p0,v100,fine,tool0;\r\n  ENDPROC\r\nENDMODULE\r\n").encode(), {"cartesian targets": str(count)}


def fanuc(rng):
    count = rng.randrange(2, 12)
    text = "/PROG  INVENTED\n/ATTR\nOWNER\t\t= MNEDITOR;\n/MN\n" + "".join("   %d:L P[%d] 100mm/sec FINE    ;\n" % (k, k) for k in range(1, count + 1)) + "/POS\n"
    text += "".join("P[%d]{\n   GP1:\n\tUF : 0, UT : 1,\t\tCONFIG : 'N U T, 0, 0, 0',\n\tX =  %s  mm,\tY =  %s  mm,\tZ =  %s  mm\n};\n" % (k, number(rng, -900, 900, 3), number(rng, -900, 900, 3), number(rng, 0, 900, 3)) for k in range(1, count + 1))
    return "invented.ls", (text + "/END\n").encode(), {"cartesian targets": str(count)}


def yaskawa(rng):
    count = rng.randrange(2, 12)
    text = "/JOB\r\n//NAME INVENTED\r\n//POS\r\n///NPOS %d,0,0,0,0,0\r\n///TOOL 0\r\n///POSTYPE PULSE\r\n///PULSE\r\n" % count
    text += "".join("C%05d=%d,%d,%d,%d,%d,%d\r\n" % ((k,) + tuple(rng.randrange(-90000, 90000) for _ in range(6))) for k in range(count))
    return "INVENTED.JBI", (text + "//INST\r\nNOP\r\nMOVJ C00000 VJ=50.00\r\nEND\r\n").encode(), {}


def urscript(rng):
    count = rng.randrange(2, 12)
    text = "def invented():\n  set_tcp(p[0,0,0.1,0,0,0])\n" + "".join("  movel(p[%s,%s,%s,0,3.14,0],a=1.2,v=0.25)\n" % (number(rng, -1, 1), number(rng, -1, 1), number(rng, 0, 1)) for _ in range(count))
    return "invented.script", (text + "  movej([0.0,-1.57,1.57,0.0,1.57,0.0],a=1.4,v=1.05)\nend\n").encode(), {"cartesian targets": str(count), "joint targets": "1"}


def kalibr_target(rng):
    if rng.random() < 0.5:
        text = "target_type: 'aprilgrid'\ntagCols: %d\ntagRows: 6\ntagSize: %s\ntagSpacing: 0.3\n" % (rng.randrange(4, 9), number(rng, 0.02, 0.1))
    else:
        text = "target_type: 'checkerboard'\ntargetCols: %d\ntargetRows: 7\nrowSpacingMeters: %s\ncolSpacingMeters: 0.05\n" % (rng.randrange(4, 9), number(rng, 0.02, 0.1))
    return "target.yaml", text.encode(), {}


def cell(rng):
    joints = rng.choice([4, 6, 7])
    text = 'schema = 1\n\n[robot]\nname = "invented"\nconvention = "%s"\ngravity_m_s2 = [0.0, 0.0, -9.80665]\n' % rng.choice(["dh", "mdh"])
    text += "".join("\n[[robot.joint]]\na_mm = %s\nalpha_deg = 90.0\nd_mm = 0.0\ntheta_offset_deg = 0.0\nsign = 1\n" % number(rng, 0, 500, 1) for _ in range(joints))
    return "cell.toml", (text + '\n[tool]\nmodel = "rigid"\ntcp_mm = [0.0, 0.0, 100.0]\n').encode(), {"joints": str(joints)}


def configuration(rng):
    text = 'cell = "cells/%s.toml"\n\n[robot]\nprofile = "profiles/universal-robots.toml"\nhost = "192.168.0.%d"\n\n[plc]\nlisten = "0.0.0.0"\n' % (rng.choice(["ur10", "kr210"]), rng.randrange(2, 250))
    return "plumbline.toml", text.encode(), {}


def lens_json(rng):
    w, h, fx, fy, cx, cy = lens_numbers(rng)
    text = json.dumps({"schema": 1, "accepted": True, "reasons": [], "image_size": [w, h], "fx": fx, "fy": fy, "cx": cx, "cy": cy,
                       "distortion": dict(zip(("k1", "k2", "p1", "p2", "k3"), terms_of(rng, 5))), "rms_px": 0.2}, indent=rng.choice([None, 2]))
    return "lens.json", text.encode(), {}


def png(rng):
    w, h = rng.randrange(2, 40), rng.randrange(2, 40)
    def chunk(name, data):
        return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))
    rows = b"".join(b"\0" + bytes(rng.randrange(256) for _ in range(w)) for _ in range(h))
    data = b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", w, h, 8, 0, 0, 0, 0)) + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")
    return "image.png", data, {"image size": "%d x %d px" % (w, h)}


def xlsx(rng):
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as archive:
        archive.writestr("[Content_Types].xml", "<Types/>")
        archive.writestr("xl/workbook.xml", "<workbook/>" * rng.randrange(1, 30))
        archive.writestr("xl/worksheets/sheet1.xml", "<worksheet/>")
    return "theta.xlsx", out.getvalue(), {}


def gzipped(rng):
    out = io.BytesIO()
    with gzip.GzipFile(rng.choice(["part.wrl", "joints.csv", "a"]), "wb", fileobj=out, mtime=rng.randrange(2**31)) as file:
        file.write(bytes(rng.randrange(256) for _ in range(rng.randrange(20, 300))))
    return rng.choice(["part.wrl.gz", "part.wrl", "data.csv"]), out.getvalue(), {}


def pdf(rng):
    text = "%%PDF-1.%d\n1 0 obj\n<< /Type /Catalog >>\nendobj\n" % rng.randrange(3, 8) + "x" * rng.randrange(10, 500) + "\nxref\n0 1\ntrailer\n<< >>\nstartxref\n9\n%%EOF\n"
    return "report.pdf", text.encode(), {}


def bag(rng):
    return "run.bag", b"#ROSBAG V2.0\nE\0\0\0" + bytes(rng.randrange(256) for _ in range(rng.randrange(20, 300))), {}


UR_NAMES = ["shoulder", "upper_arm", "forearm", "wrist_1", "wrist_2", "wrist_3"]

# kind: maker. The kind is the word that explain must give.
MAKERS = {
    "opencv-lens": opencv_lens, "ros-camera-info": ros_camera_info, "ros-camera-info-echo": ros_echo, "ros-ini-lens": ros_ini,
    "kalibr-camchain": kalibr, "mrcal-cameramodel": mrcal, "colmap-cameras": colmap, "artoolkit-lens": artoolkit,
    "lens-json": lens_json, "urdf": urdf, "xacro": xacro, "ur-kinematics": factory_table(UR_NAMES),
    "joint-frames": factory_table(["joint%d" % k for k in range(1, 7)]), "sdf": sdf, "mjcf": mjcf, "dh-table": dh_table,
    "measured": measured, "tracker": tracker, "cmm": cmm, "rtde": rtde, "ros-csv": ros_csv,
    "vrml97": vrml("#VRML V2.0 utf8", VRML2, "part.wrl"), "vrml1": vrml("#VRML V1.0 ascii", INVENTOR, "part.wrl"),
    "open-inventor": vrml("#Inventor V2.1 ascii", INVENTOR, "part.wrl"), "stl-text": stl_text, "stl-binary": stl_binary,
    "obj": obj, "ply": ply, "collada": collada, "step": step, "krl-program": krl, "rapid-program": rapid,
    "fanuc-program": fanuc, "yaskawa-job": yaskawa, "urscript": urscript, "kalibr-target": kalibr_target,
    "cell": cell, "configuration": configuration, "png": png, "xlsx": xlsx, "gzip": gzipped, "pdf": pdf, "rosbag1": bag,
}

BINARY = {"artoolkit-lens", "stl-binary", "png", "xlsx", "gzip", "rosbag1"}


# Mutations: (bytes, rng) -> bytes. Those of text leave binary files alone.
def truncated(data, rng):
    return data[:max(1, int(len(data) * rng.uniform(0.2, 0.95)))]


def flipped(data, rng):
    data = bytearray(data)
    for _ in range(rng.choice([1, 3, 10])):
        data[rng.randrange(len(data))] ^= 1 << rng.randrange(8)
    return bytes(data)


def separators(data, rng):
    old, new = rng.choice([(b",", b";"), (b",", b"\t"), (b":", b" :"), (b" ", b"  "), (b"=", b" = ")])
    return data.replace(old, new)


def without_head(data, rng):
    lines = data.split(b"\n")
    return b"\n".join(lines[rng.choice([1, 1, 2, 3]):])


def encoded(data, rng):
    try:
        text = data.decode()
    except UnicodeDecodeError:
        text = data.decode("latin-1")
    return rng.choice([lambda: text.encode("utf-16"), lambda: b"\xef\xbb\xbf" + data, lambda: data.replace(b"\r\n", b"\n").replace(b"\n", b"\r\n"),
                       lambda: text.encode("utf-16-le"), lambda: b"\n\n" + data])()


MUTATIONS = {"truncated": truncated, "bytes flipped": flipped, "separators": separators, "head removed": without_head, "other encoding": encoded}
