#!/usr/bin/env python3
"""Writes the small checkpoints of testdata/tensors/ with PyTorch itself (any version from 2.1; 2.13.0 made those there).

    python3 scripts/make_tensor_testdata.py testdata/tensors

Values follow from the names, so tensor_file_test.cc can expect them: element i of the tensor number t (in the order in
which a file mentions them, from 0) is t + i / 16.
"""
import io
import pickle
import sys
import zipfile
from collections import OrderedDict
from pathlib import Path

import torch


def ramp(t, *shape, dtype=torch.float32):
    count = 1
    for extent in shape:
        count *= extent
    return (t + torch.arange(count, dtype=torch.float64) / 16).reshape(shape).to(dtype)


class Call:
    """Pickles as the call of any function: what an attacker would write."""

    def __init__(self, function, *arguments):
        self.call = (function, arguments)

    def __reduce__(self):
        return self.call


def main():
    folder = Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    save = lambda value, name, **options: torch.save(value, folder / name, **options)

    # What nn.Module.state_dict() gives: OrderedDict with a _metadata attribute, BatchNorm's int64 counter included.
    state = OrderedDict()
    state['embedding.0.weight'] = ramp(0, 4, 3)
    state['embedding.0.bias'] = ramp(1, 4)
    state['embedding.1.running_mean'] = ramp(2, 4)
    state['embedding.1.num_batches_tracked'] = torch.tensor(7)
    state._metadata = OrderedDict([('', {'version': 1}), ('embedding', {'version': 1}), ('embedding.1', {'version': 2}),
                                   ('act', {'version': 1})])
    save(state, 'state_dict.pth')
    save(state, 'legacy.pth', _use_new_zipfile_serialization=False)
    save(state, 'protocol4.pth', pickle_protocol=4)

    # A training script's wrapper around a model in DistributedDataParallel.
    wrapped = OrderedDict(('module.' + key, value) for key, value in state.items())
    save({'epoch': 12, 'state_dict': wrapped, 'best': 31.25, 'arch': 'ptv3', 'finished': True, 'note': None,
          'betas': (0.9, 0.999)}, 'wrapped.pth')

    # Views of one storage: offset, transposed, every second, repeated.
    base = ramp(0, 6, 4)
    save({'base': base, 'rows': base[2:4], 'transposed': base.t(), 'column': base[:, 1], 'second': base[::2, 1::2],
          'repeated': base[:1].expand(5, 4), 'empty': base[:0], 'scalar': base[5, 3]}, 'views.pth')

    # All element types; uint16 and wider unsigned ones go through _rebuild_tensor_v3.
    types = ['float64', 'float32', 'float16', 'bfloat16', 'int64', 'int32', 'int16', 'int8', 'uint8', 'bool', 'uint16',
             'uint32', 'uint64']
    save({name: ramp(1, 3, 2, dtype=getattr(torch, name)) for name in types}, 'types.pth')

    parameter = torch.nn.Parameter(ramp(0, 2, 2))
    save({'parameter': parameter, 'same': parameter, 'frozen': torch.nn.Parameter(ramp(1, 2), requires_grad=False)},
         'parameters.pth')

    # gsplat's examples/simple_trainer.py: {"step": …, "splats": ParameterDict.state_dict()}.
    for degree in (0, 1, 3):
        rest = (degree + 1)**2 - 1
        splats = torch.nn.ParameterDict({
            'means': torch.nn.Parameter(ramp(0, 5, 3)), 'scales': torch.nn.Parameter(ramp(1, 5, 3)),
            'quats': torch.nn.Parameter(ramp(2, 5, 4)), 'opacities': torch.nn.Parameter(ramp(3, 5)),
            'sh0': torch.nn.Parameter(ramp(4, 5, 1, 3)), 'shN': torch.nn.Parameter(ramp(5, 5, rest, 3))})
        save({'step': 14999, 'splats': splats.state_dict()}, f'ckpt_degree{degree}.pt')

    # --- files that must be refused ---
    save({'weight': ramp(0, 2), 'bad': Call(print, 'boo')}, 'hostile_call.pth')
    save({'weight': torch.zeros(2, dtype=torch.complex64)}, 'complex.pth')
    (folder / 'pickle.pth').write_bytes(pickle.dumps({'weight': [1.0, 2.0]}, protocol=2))
    memory = io.BytesIO()
    torch.save({'weight': ramp(0, 2)}, memory)
    with zipfile.ZipFile(memory) as source:
        with zipfile.ZipFile(folder / 'compressed.pth', 'w', zipfile.ZIP_DEFLATED) as target:
            for name in source.namelist():
                target.writestr(zipfile.ZipInfo(name), source.read(name), zipfile.ZIP_DEFLATED)
        with zipfile.ZipFile(folder / 'big_endian.pth', 'w') as target:
            for name in source.namelist():
                content = b'big' if name.endswith('byteorder') else source.read(name)
                target.writestr(zipfile.ZipInfo(name), content)


if __name__ == '__main__':
    main()
