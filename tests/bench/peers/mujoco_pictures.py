"""Pictures of a table with eight blocks and a gripper by MuJoCo's renderer without a graphics card: SIZE all | colours

`all`: what ours draws at once, a picture with shadows, its depths and its segments; MuJoCo draws three times for that.
`colours`: MuJoCo at its fastest, no shadows, one sample a pixel, and neither depths nor segments.
Needs: pip install mujoco; apt-get install libosmesa6
"""

import json
import os
import sys
import time

os.environ["MUJOCO_GL"] = "osmesa"
import mujoco  # noqa: E402

SIZE, IS_ALL = int(sys.argv[1]), sys.argv[2] == "all"
PICTURES = {64: 1000, 224: 300}[SIZE] // (3 if IS_ALL else 1)

BLOCKS = "".join(
    f'<body pos="{-0.15 + 0.1 * (n % 4)} {0.1 * (n // 4)} 0.025"><freejoint/>'
    f'<geom type="box" size="0.025 0.025 0.025" rgba="{n / 8} {1 - n / 8} 0.5 1"/></body>'
    for n in range(8)
)
SCENE = f"""<mujoco>
  <visual><quality offsamples="0" shadowsize="{1024 if IS_ALL else 0}"/></visual>
  <worldbody>
    <light pos="0 0 2" castshadow="{str(IS_ALL).lower()}"/>
    <geom type="box" size="0.4 0.4 0.02" pos="0 0 -0.02" rgba="0.6 0.5 0.4 1"/>
    {BLOCKS}
    <body pos="0 0 0.3">
      <geom type="box" size="0.04 0.02 0.02"/>
      <geom type="box" size="0.005 0.01 0.03" pos="0.035 0 -0.04"/>
      <geom type="box" size="0.005 0.01 0.03" pos="-0.035 0 -0.04"/>
      <geom type="cylinder" size="0.02 0.2" pos="0 0 0.2"/>
    </body>
    <camera name="front" pos="0 -0.9 0.7" xyaxes="1 0 0 0 0.61 0.79"/>
  </worldbody>
</mujoco>"""

model = mujoco.MjModel.from_xml_string(SCENE)
data = mujoco.MjData(model)
mujoco.mj_forward(model, data)
with mujoco.Renderer(model, SIZE, SIZE) as renderer:
    renderer.scene.flags[mujoco.mjtRndFlag.mjRND_SHADOW] = IS_ALL
    renderer.scene.flags[mujoco.mjtRndFlag.mjRND_REFLECTION] = False

    def draw() -> None:
        renderer.update_scene(data, "front")
        assert renderer.render().any(), "an empty picture"
        if not IS_ALL:
            return
        renderer.enable_depth_rendering()
        assert renderer.render().any(), "no depths"
        renderer.disable_depth_rendering()
        renderer.enable_segmentation_rendering()
        assert renderer.render().any(), "no segments"
        renderer.disable_segmentation_rendering()

    draw()
    begin = time.process_time()
    for _ in range(PICTURES):
        draw()
    secs = time.process_time() - begin
print(json.dumps({"peer": f"MuJoCo {mujoco.__version__}, OSMesa", "value": PICTURES / secs}))
