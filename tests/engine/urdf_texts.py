"""Small URDFs, put together from parts of which one may be wrong."""

LIMIT = '<limit lower="-1" upper="1" effort="5" velocity="2"/>'


def joint(name: str, parent: str, child: str, kind: str = "revolute", inside: str = LIMIT) -> str:
    ends = f'<parent link="{parent}"/><child link="{child}"/>'
    return f'<joint name="{name}" type="{kind}">{ends}<origin xyz="0.1 0 0.2" rpy="0.1 0 0"/>{inside}</joint>'


def links(*names: str) -> str:
    return "".join(f'<link name="{name}"/>' for name in names)


def urdf(*parts: str) -> str:
    return f'<robot name="test">{"".join(parts)}</robot>'


GOOD = urdf(links("a", "b", "c"), joint("one", "a", "b"), joint("two", "b", "c"))
