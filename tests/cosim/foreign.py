"""Foreign FMUs: C sources compiled with the system's compiler, good ones and bad ones."""

from __future__ import annotations

import shutil
import subprocess
import zipfile
from pathlib import Path
from typing import Final

import fmpy

SOURCES: Final = Path(__file__).with_name("fmus")
GUID: Final = "{8c4e810f}"
COMPILER: Final = shutil.which("gcc") or shutil.which("cc")

_UNITS: Final = """
  <Unit name="L"><BaseUnit m="3" factor="0.001"/></Unit>
  <Unit name="cmH2O"><BaseUnit kg="1" m="-1" s="-2" factor="98.0665"/></Unit>
"""

# name, value reference, type, causality, attributes of the value
_VARIABLES: Final = [
    ("gain", 0, "Real", "parameter", 'start="5"'),
    ("target", 1, "Real", "parameter", 'start="3" unit="L"'),
    ("volume", 2, "Real", "input", 'start="0" unit="L"'),
    ("delta_p", 3, "Real", "output", 'unit="cmH2O"'),
    ("clock", 4, "Real", "output", 'unit="s"'),
]

_TYPED: Final = [
    ("count", 0, "Integer", "output", ""),
    ("stride", 1, "Integer", "input", 'start="1"'),
    ("level", 2, "Enumeration", "output", 'declaredType="Level"'),
    ("wanted", 3, "Enumeration", "input", 'declaredType="Level" start="1"'),
    ("on", 0, "Boolean", "output", ""),
    ("enabled", 1, "Boolean", "input", 'start="true"'),
]

_OFFSETS: Final = {"Integer": 30, "Enumeration": 30, "Boolean": 40}
"""Of value references in FMI 3.0, where they are unique."""

_ARRAYS: Final = """
  <UInt64 name="size" valueReference="20" causality="structuralParameter" variability="fixed"
    start="2"/>
  <Float64 name="in" valueReference="10" causality="input" start="0 0">
    <Dimension valueReference="20"/></Float64>
  <Float64 name="out" valueReference="11" causality="output">
    <Dimension valueReference="20"/></Float64>
  <Float64 name="gains" valueReference="12" causality="parameter" variability="fixed" start="1 2">
    <Dimension valueReference="20"/></Float64>
"""


VARIABLE_STEP: Final = 'canHandleVariableCommunicationStepSize="true"'
STATES: Final = " ".join(
    f'canGetAndSetFMU{state}="true" canSerializeFMU{state}="true"' for state in ("state", "State")
)
"""Flags of FMI 2.0 and 3.0 that promise to save and restore."""


def compiled(
    folder: Path,
    version: int,
    *defines: str,
    ports: str = "",
    flags: str = VARIABLE_STEP,
    experiment: str = "",
) -> Path:
    """Compile an FMU of FMI `version` into a folder.

    `defines` are macros of foreign.h. `ports` may name "typed" and "arrays", which it then has,
    too. `flags` and `experiment` are attributes of its description.
    """
    library = folder / "Foreign.so"
    headers = Path(fmpy.__file__).with_name("c-code")
    macros = [f"-D{define}" for define in defines]
    source = SOURCES / f"foreign{version}.c"
    subprocess.run(
        [str(COMPILER), "-shared", "-fPIC", "-w", f"-I{headers}", *macros, source, "-o", library],
        check=True,
    )
    platform = fmpy.platform_tuple if version == 3 else fmpy.platform
    variables = _VARIABLES + (_TYPED if "typed" in ports else [])
    describe = (_description1, _description2, _description3)[version - 1]
    text = describe(variables, flags, experiment, "arrays" in ports)
    with zipfile.ZipFile(folder / "foreign.fmu", "w") as archive:
        archive.write(library, f"binaries/{platform}/Foreign{fmpy.sharedLibraryExtension}")
        archive.writestr("modelDescription.xml", text)
    return folder / "foreign.fmu"


def _description2(variables: list, flags: str, experiment: str, arrays: bool) -> str:
    rows = "\n".join(
        f'<ScalarVariable name="{name}" valueReference="{key}" causality="{causality}" '
        f'variability="{_variability(kind, causality)}"><{kind} {rest}/></ScalarVariable>'
        for name, key, kind, causality, rest in variables
    )
    return f"""<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="Foreign" guid="{GUID}">
<CoSimulation modelIdentifier="Foreign" {flags}/>
<UnitDefinitions>{_UNITS}</UnitDefinitions>
<TypeDefinitions><SimpleType name="Level"><Enumeration>
  <Item name="low" value="1"/><Item name="high" value="2"/>
</Enumeration></SimpleType></TypeDefinitions>
<DefaultExperiment {experiment}/>
<ModelVariables>{rows}</ModelVariables>
<ModelStructure/>
</fmiModelDescription>"""


def _description1(variables: list, flags: str, experiment: str, arrays: bool) -> str:
    rows = "\n".join(
        f'<ScalarVariable name="{name}" valueReference="{key}" '
        + ('variability="parameter">' if causality == "parameter" else f'causality="{causality}">')
        + f"<{kind} {rest}/></ScalarVariable>"
        for name, key, kind, causality, rest in variables
    )
    return f"""<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="1.0" modelName="Foreign" modelIdentifier="Foreign"
  guid="{GUID}" numberOfContinuousStates="0" numberOfEventIndicators="0">
<TypeDefinitions><Type name="Level"><EnumerationType>
  <Item name="low"/><Item name="high"/>
</EnumerationType></Type></TypeDefinitions>
<ModelVariables>{rows}</ModelVariables>
<Implementation><CoSimulation_StandAlone><Capabilities {flags}/></CoSimulation_StandAlone>
</Implementation>
</fmiModelDescription>"""


def _description3(variables: list, flags: str, experiment: str, arrays: bool) -> str:
    kinds = {"Real": "Float64", "Integer": "Int8"}
    rows = "\n".join(
        f'<{kinds.get(kind, kind)} name="{name}" valueReference="{key + _OFFSETS.get(kind, 0)}" '
        f'causality="{causality}" variability="{_variability(kind, causality)}" {rest}/>'
        for name, key, kind, causality, rest in variables
    )
    return f"""<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="3.0" modelName="Foreign" instantiationToken="{GUID}">
<CoSimulation modelIdentifier="Foreign" {flags}/>
<UnitDefinitions>{_UNITS}</UnitDefinitions>
<TypeDefinitions><EnumerationType name="Level">
  <Item name="low" value="1"/><Item name="high" value="2"/>
</EnumerationType></TypeDefinitions>
<DefaultExperiment {experiment}/>
<ModelVariables>
  <Float64 name="time" valueReference="99" causality="independent"/>
  {rows}{_ARRAYS if arrays else ""}
</ModelVariables>
<ModelStructure/>
</fmiModelDescription>"""


def _variability(kind: str, causality: str) -> str:
    if causality == "parameter":
        return "fixed"
    return "continuous" if kind == "Real" else "discrete"
