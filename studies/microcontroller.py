"""Memory and instructions of the embedded estimators: ``python studies/microcontroller.py``.

The exported library of the paper's vehicle, compiled for a Cortex-M7, runs under QEMU on synthetic
samples. QEMU's clock counts instructions (1 ns each); overwritten bytes of a painted stack are its
depth.
"""

from __future__ import annotations

import subprocess
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np

import hydrodamp as hd
from hydrodamp.export.c99 import IDENTIFIER_SOURCES, SOURCES, STRICT, C
from hydrodamp.export.plant import ExportedPlant
from hydrodamp.export.target import save_files
from tables import TABLES, replace_table

PAGE = Path(__file__).parents[1] / "docs" / "how-to" / "live" / "microcontroller.md"

#: Startup code and linker script of the bare processor.
START = """
#include <stdint.h>
extern int main(void);
extern void initialise_monitor_handles(void);
extern void exit(int);
void _init(void) {}
void _fini(void) {}
void reset(void)
{
    *(volatile uint32_t *)0xE000ED88 |= 0xFu << 20; /* the FPU */
    __asm volatile("dsb\\n isb");
    initialise_monitor_handles();
    exit(main());
}
__attribute__((section(".vectors"), used)) static const struct {
    uint32_t stack;
    void (*reset)(void);
} vectors = {0x20400000, reset};
"""
LAYOUT = """
SECTIONS {
  . = 0; .text : { KEEP(*(.vectors)) *(.text*) *(.rodata*) *(.ARM*) }
  . = 0x20000000; .data : { *(.data*) } .bss : { *(.bss*) *(COMMON) }
  end = .;
}
"""
CORTEX = ("-mcpu=cortex-m7", "-mthumb", "-mfpu=fpv5-d16", "-mfloat-abi=hard")
TOOLS = ("arm-none-eabi-gcc", "qemu-system-arm")

#: Methods of the library, and their names in its header.
METHODS = {"ai-composite": "AI_COMPOSITE", "rls": "RLS", "ai": "AI"}

#: Each identifier on 2000 synthetic samples of 0.1 s. Prints mean and maximum instructions a step,
#: bytes of stack (on ARM), and the bytes of the estimate.
PROGRAM = """
#include "NAME_identifier.h"
#include <stdio.h>

#ifdef __arm__
#define PAINTED 32768
static uint32_t now(void) { return *(volatile uint32_t *)0xE000E018; }
static volatile unsigned char *below(void)
{
    volatile unsigned char *sp;
    __asm volatile("mov %0, sp" : "=r"(sp));
    return sp;
}
#else
static uint32_t now(void) { return 0; }
#endif

static uint64_t seed = 42;
static hd_real any(hd_real size)
{
    seed = seed * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
    return size * ((hd_real)(int32_t)((seed >> 44) & 0x1ffff) / 65536 - 1);
}

typedef int (*step)(hd_real *, hd_real, const hd_real *, const hd_real *, const hd_real *,
                    const hd_real *);

static hd_real state[NAME_AI_COMPOSITE_STATE + NAME_RLS_STATE], found[NAME_COEFFICIENTS];

static void sail(step one)
{
    hd_real velocity[6] = {0}, inputs[NAME_INPUTS + 1] = {0};
    const hd_real down[3] = {0, 0, 1}, none[6] = {0};
    uint32_t most = 0;
    double sum = 0;
    int stack = 0;

    for (int k = 0; k < 2000; ++k) {
        for (int i = 0; i < 6; ++i)
            velocity[i] += (hd_real)0.1 * ((i ? 0 : 1) + any(1) - velocity[i]);
        const uint32_t then = now();
        (void)one(state, (hd_real)0.1, velocity, down, inputs, none);
        const uint32_t took = (then - now()) & 0xffffffu;
        most = took > most ? took : most;
        sum += took;
    }
#ifdef __arm__
    volatile unsigned char *top = below(), *deepest = top - PAINTED;
    for (volatile unsigned char *at = deepest; at < top; ++at)
        *at = 0xA5;
#endif
    for (int k = 0; k < 20; ++k)
        (void)one(state, (hd_real)0.1, velocity, down, inputs, none);
#ifdef __arm__
    while (*deepest == 0xA5)
        ++deepest;
    stack = (int)(top - deepest);
#endif
    printf("took %d %d %d\\n", (int)(40 * sum / 2000), (int)(40 * most), stack);
}

static void tell(void)
{
    for (size_t i = 0; i < sizeof found; ++i) /* no small printf has %a */
        printf("%02x", ((const unsigned char *)found)[i]);
    printf("\\n");
}

#define TRY(way)                          \\
    NAME_##way##_init(state, NAME_start); \\
    sail(NAME_##way##_step);              \\
    NAME_##way##_estimate(state, found);  \\
    tell();

int main(void)
{
#ifdef __arm__
    *(volatile uint32_t *)0xE000E014 = 0xffffff; /* SysTick, by the processor's clock */
    *(volatile uint32_t *)0xE000E010 = 5;
#endif
    TRY(ai_composite) TRY(rls) TRY(ai)
    return 0;
}
"""


def run_on_cortex(folder: Path, program: str, flags: Sequence[str] = ()) -> str:
    """Return what a C program of an exported library prints on a Cortex-M7 under QEMU."""
    (folder / "start.c").write_text(START)
    (folder / "layout.ld").write_text(LAYOUT)
    call = [TOOLS[0], *STRICT, *CORTEX, *flags, "--specs=rdimon.specs", "-nostartfiles"]
    call += ["-T", "layout.ld", program, "start.c", *SOURCES, *IDENTIFIER_SOURCES]
    subprocess.run([*call, "-lm", "-o", "cortex.elf"], cwd=folder, check=True)
    machine = [TOOLS[1], "-M", "mps2-an500", "-cpu", "cortex-m7", "-nographic", "-semihosting"]
    machine += ["-icount", "shift=0", "-monitor", "none", "-serial", "none", "-kernel"]
    process = subprocess.run(
        [*machine, folder / "cortex.elf"], capture_output=True, text=True, check=True, timeout=60
    )
    return process.stdout + process.stderr


def measure_code_size(folder: Path, flags: Sequence[str] = ()) -> int:
    """Return bytes of code and constants of an exported library on a Cortex-M7, by ``-Os``."""
    sources = (*SOURCES, *IDENTIFIER_SOURCES)
    subprocess.run(
        [TOOLS[0], *STRICT, "-Os", *CORTEX, *flags, "-c", *sources], cwd=folder, check=True
    )
    objects = [f"{Path(name).stem}.o" for name in sources]
    process = subprocess.run(
        ["arm-none-eabi-size", *objects], cwd=folder, capture_output=True, text=True, check=True
    )
    return sum(int(line.split()[0]) for line in process.stdout.splitlines()[1:])


def write_program(folder: Path, name: str) -> str:
    """Write the measuring program of a vehicle into the folder of its library."""
    (folder / "measure.c").write_text(PROGRAM.replace("NAME", name))
    return "measure.c"


def measure_identifiers(model: str, precision: str) -> list[str]:
    """Return rows of the table for the identifiers of a model; print the code size."""
    damping_model = hd.catalog[model]
    damping = hd.Damping(damping_model, np.full(damping_model.n_coefficients, -1.0))
    plant, form = ExportedPlant.of(hd.fleet["vt690"], damping), C(precision=precision)
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        save_files(form.render_files(plant), folder)
        output = run_on_cortex(folder, write_program(folder, "auv_vt690"), form.flags)
        print(model, precision, measure_code_size(folder, form.flags), "bytes of code")
        header = (folder / "auv_vt690_identifier.h").read_text()
    size, rows = 4 if precision == "float" else 8, []
    for method, line in zip(METHODS, output.splitlines()[::2], strict=True):
        mean, maximum, stack = map(int, line.split()[1:])
        numbers = int(header.split(f"auv_vt690_{METHODS[method]}_STATE = ")[1].split(",")[0])
        cells = f"{numbers * size} | {stack} | {mean} | {maximum}"
        rows.append(f"| {model} | `{method}` | {precision} | {cells} |")
    return rows


def main() -> None:
    """Measure, and write the table into its page."""
    head = (
        "| model | method | precision | state [B] | stack [B] | instructions per step | maximum |"
    )
    models = [(key, real) for key in ("prestero", "pitch-yaw") for real in ("float", "double")]
    body = [line for key, real in models for line in measure_identifiers(key, real)]
    replace_table(PAGE, TABLES, "\n".join([head, "|---|---|---|---|---|---|---|", *body]))


if __name__ == "__main__":
    main()
