"""Studies of results that were made elsewhere."""

from clearance_mj.study import Study


def study_of(dataset, laws, cases=(), tests=None, engines=(), cache=None, **results):
    """A study of given laws; cases, tests and whatever `Study` computes (``repeatability``, ...) as they are given."""
    study = Study(dataset, (), engines or tuple(dict.fromkeys(case.engine for case in cases)), cache)
    study.methods = tuple(law.name for law in laws)
    study.studied_laws.identified = {law.name: law for law in laws}
    study._tests = dict(tests or {})
    study._cases = {(case.law, case.engine, case.record.name): case for case in cases}
    for name, value in results.items():
        setattr(study, name, value)
    return study
